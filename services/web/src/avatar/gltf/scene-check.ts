/**
 * Check of a file's nodes, skins, meshes and materials before three.js builds them: all that they refer to exists, the
 * nodes are a tree (glTF 2.0, 3.5.2), and what is drawn is bounded.
 */
import { translate } from "../../i18n/translator";
import { fileBroken } from "../error";
import { externalFile, megabytes } from "./data-check";
import { asList, asRecord, asText, type JsonRecord } from "./json";
import { beyondEnd, type GltfJson, invalidField, tooMuch, wholeNumber } from "./schema";

const MAX_NODES = 20_000;
const MAX_DEPTH = 500;
const MAX_SKIN_JOINTS = 50_000;
/** Limit of the vertices that are drawn, each mesh once for each of its nodes. */
const MAX_DRAWN_VERTICES = 8e6;
/** Limit of the draw calls of a frame. */
const MAX_DRAWN_PRIMITIVES = 5_000;
/** Limit of all morph targets; the renderer stores a vector of four floats for each vertex and attribute. */
const MAX_MORPH_BYTES = 512e6;
const MORPH_VECTOR_BYTES = 16;
/** Numbers of a node's transform by field. */
const TRANSFORM_LENGTHS = { matrix: 16, translation: 3, rotation: 4, scale: 3 };
/** Largest difference of a quaternion's length from 1. */
const MAX_ROTATION_ERROR = 0.1;
/** Largest number in a transform; a float of the renderer loses what is smaller than a ten millionth of it. */
const MAX_TRANSFORM = 1e7;
/** Extension that multiplies what is drawn, and has no use in an avatar. */
const INSTANCING = "EXT_mesh_gpu_instancing";

/** Return the parent of each node, -1 for roots, after the check. Throw AvatarError. */
export function checkScene(json: GltfJson): readonly number[] {
  const parents = checkTree(json);
  const vertices = checkMeshes(json);
  checkSkins(json);
  let [drawnVertices, drawnPrimitives] = [0, 0];
  json.list("nodes").forEach((_, index) => {
    const node = json.item("nodes", index);
    const field = `nodes[${index}]`;
    for (const [name, length] of Object.entries(TRANSFORM_LENGTHS))
      checkNumbers(node[name], `${field}.${name}`, length);
    const turn = node.rotation as number[] | undefined;
    if (turn && Math.abs(Math.hypot(...turn) - 1) > MAX_ROTATION_ERROR) throw invalidField(`${field}.rotation`, turn);
    if (asRecord(node.extensions)[INSTANCING] !== undefined)
      throw fileBroken(translate("{field} is not supported", { field: `${field}.extensions.${INSTANCING}` }));
    json.optionalReference("skins", node.skin, `${field}.skin`);
    const mesh = json.optionalReference("meshes", node.mesh, `${field}.mesh`);
    if (mesh === null) return;
    drawnVertices += vertices[mesh];
    drawnPrimitives += asList(json.item("meshes", mesh).primitives).length;
    if (drawnVertices > MAX_DRAWN_VERTICES || drawnPrimitives > MAX_DRAWN_PRIMITIVES)
      throw tooMuch(
        `${field}.mesh`,
        translate("{vertices} vertices in {primitives} parts", {
          vertices: drawnVertices,
          primitives: drawnPrimitives,
        }),
        translate("{vertices} vertices in {primitives} parts", {
          vertices: MAX_DRAWN_VERTICES,
          primitives: MAX_DRAWN_PRIMITIVES,
        }),
      );
  });
  asList(json.root.scenes).forEach((scene, index) => {
    asList(asRecord(scene).nodes).forEach((node, at) => {
      json.reference("nodes", node, `scenes[${index}].nodes[${at}]`);
    });
  });
  const sceneCount = asList(json.root.scenes).length;
  if (json.root.scene !== undefined && wholeNumber(json.root.scene, "scene") >= sceneCount)
    throw invalidField("scene", json.root.scene);
  checkTextures(json);
  return parents;
}

/** Return the parent of each node. Throw AvatarError if the nodes are no tree. */
function checkTree(json: GltfJson): number[] {
  const nodes = json.list("nodes");
  if (nodes.length > MAX_NODES) throw tooMuch("nodes", `${nodes.length}`, `${MAX_NODES}`);
  const parents = nodes.map(() => -1);
  nodes.forEach((_, index) => {
    asList(json.item("nodes", index).children).forEach((value, at) => {
      const field = `nodes[${index}].children[${at}]`;
      const child = json.reference("nodes", value, field);
      if (parents[child] >= 0)
        throw fileBroken(translate("{field}: node {node} has two parents", { field, node: child }));
      parents[child] = index;
    });
  });
  const depths = new Map<number, number>([[-1, 0]]);
  for (let index = 0; index < parents.length; index++) {
    const path: number[] = [];
    for (let at = index; !depths.has(at); at = parents[at]) {
      if (path.length > MAX_DEPTH || path.includes(at))
        throw fileBroken(
          path.includes(at)
            ? translate("nodes[{node}] is its own ancestor", { node: at })
            : translate("the nodes are nested more than {max} deep", { max: MAX_DEPTH }),
        );
      path.push(at);
    }
    for (const at of path.reverse()) {
      const depth = (depths.get(parents[at]) ?? 0) + 1;
      if (depth > MAX_DEPTH)
        throw fileBroken(translate("the nodes are nested more than {max} deep", { max: MAX_DEPTH }));
      depths.set(at, depth);
    }
  }
  return parents;
}

/** Return the number of vertices of each mesh. */
function checkMeshes(json: GltfJson): number[] {
  let morphBytes = 0;
  return json.list("meshes").map((_, index) => {
    const primitives = asList(json.item("meshes", index).primitives);
    if (primitives.length === 0) throw invalidField(`meshes[${index}].primitives`, undefined);
    let vertices = 0;
    primitives.forEach((value, at) => {
      const field = `meshes[${index}].primitives[${at}]`;
      const primitive = asRecord(value);
      const positions = json.reference(
        "accessors",
        asRecord(primitive.attributes).POSITION,
        `${field}.attributes.POSITION`,
      );
      const count = Number(json.item("accessors", positions).count);
      vertices += count;
      checkAttributes(json, asRecord(primitive.attributes), `${field}.attributes`, count);
      json.optionalReference("accessors", primitive.indices, `${field}.indices`);
      json.optionalReference("materials", primitive.material, `${field}.material`);
      asList(primitive.targets).forEach((target, k) => {
        checkAttributes(json, asRecord(target), `${field}.targets[${k}]`, count);
        morphBytes += Object.keys(asRecord(target)).length * count * MORPH_VECTOR_BYTES;
        if (morphBytes > MAX_MORPH_BYTES)
          throw tooMuch(`${field}.targets`, megabytes(morphBytes), megabytes(MAX_MORPH_BYTES));
      });
    });
    return vertices;
  });
}

function checkAttributes(json: GltfJson, attributes: JsonRecord, field: string, count: number): void {
  for (const [name, value] of Object.entries(attributes)) {
    const accessor = json.reference("accessors", value, `${field}.${name}`);
    const actual = json.item("accessors", accessor).count;
    if (actual !== count) throw invalidField(`accessors[${accessor}].count`, actual);
  }
}

function checkSkins(json: GltfJson): void {
  let jointCount = 0;
  json.list("skins").forEach((_, index) => {
    const { joints, inverseBindMatrices } = json.item("skins", index);
    const field = `skins[${index}]`;
    const indices = asList(joints).map((joint, at) => json.reference("nodes", joint, `${field}.joints[${at}]`));
    if (indices.length === 0) throw invalidField(`${field}.joints`, joints);
    jointCount += indices.length;
    if (jointCount > MAX_SKIN_JOINTS) throw tooMuch(`${field}.joints`, `${jointCount}`, `${MAX_SKIN_JOINTS}`);
    const matrices = json.optionalReference("accessors", inverseBindMatrices, `${field}.inverseBindMatrices`);
    if (matrices !== null && Number(json.item("accessors", matrices).count) < indices.length)
      throw beyondEnd(`${field}.joints`, `accessors[${matrices}]`);
  });
}

function checkTextures(json: GltfJson): void {
  json.list("images").forEach((_, index) => {
    const image = json.item("images", index);
    const uri = asText(image.uri);
    if (uri && !uri.startsWith("data:image/")) throw externalFile(uri);
    if (!uri) json.reference("bufferViews", image.bufferView, `images[${index}].bufferView`);
  });
  json.list("textures").forEach((_, index) => {
    const { source, extensions } = json.item("textures", index);
    json.optionalReference("images", source, `textures[${index}].source`);
    for (const [name, extension] of Object.entries(asRecord(extensions)))
      json.optionalReference("images", asRecord(extension).source, `textures[${index}].extensions.${name}.source`);
  });
  json.list("materials").forEach((material, index) => {
    checkMaterial(json, material, `materials[${index}]`, MAX_MATERIAL_DEPTH);
  });
}

/** Depth to which materials and their extensions nest textures. */
const MAX_MATERIAL_DEPTH = 6;

/** Check the textures of a material: objects with the name "...Texture" and an index. */
function checkMaterial(json: GltfJson, value: unknown, field: string, depth: number): void {
  if (depth === 0) return;
  for (const [name, part] of Object.entries(asRecord(value))) {
    if (typeof part !== "object" || part === null || name === "extras") continue;
    if (name.endsWith("Texture")) json.reference("textures", asRecord(part).index, `${field}.${name}.index`);
    checkMaterial(json, part, `${field}.${name}`, depth - 1);
  }
}

function isPossible(number: unknown): boolean {
  return typeof number === "number" && Math.abs(number) <= MAX_TRANSFORM;
}

function checkNumbers(value: unknown, field: string, length: number): void {
  if (value === undefined) return;
  if (!Array.isArray(value) || value.length !== length || !value.every(isPossible)) throw invalidField(field, value);
}
