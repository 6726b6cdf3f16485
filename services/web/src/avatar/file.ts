/** Reads a GLB's description and judges whether its figure can dance. Pure: the drawing parts of it are read elsewhere. */
import { say, series } from "../words/say";
import { findBones, missing, type NamedNode } from "./naming";
import { AvatarProblem, broken, exportAgain, LARGEST, tooLarge } from "./problem";

const MAGIC = 0x46546c67;
const JSON_CHUNK = 0x4e4f534a;
const HEADER = 12;
const CHUNK_HEADER = 8;

/** Compressions of glTF that need decoders of their own, and what people call them. */
const COMPRESSED: Readonly<Record<string, string>> = {
  KHR_draco_mesh_compression: "Draco",
  EXT_meshopt_compression: "meshopt",
  KHR_meshopt_compression: "meshopt",
  KHR_texture_basisu: "KTX2 textures",
};

const AS_GLB = "Export it as one binary glTF file, .glb or .vrm.";

/** What a file is: the humanoid's bones as indices of its nodes, and the name its maker gave it, if any. */
export interface AvatarFile {
  vrm: boolean;
  name: string | null;
  bones: ReadonlyMap<string, number>;
}

/** The description of the figure in a file's bytes. Throws AvatarProblem where it cannot be used, saying why. */
export function judge(bytes: ArrayBuffer): AvatarFile {
  if (bytes.byteLength > LARGEST) throw tooLarge(bytes.byteLength);
  const json = record(descriptionOf(bytes));
  for (const required of list(json.extensionsRequired)) {
    const compression = COMPRESSED[String(required)];
    if (compression) throw new AvatarProblem(say("It is compressed"), say("this page does not read {compression}", { compression }), say("Export it without {compression}.", { compression }));
  }
  const elsewhere = [...list(json.buffers), ...list(json.images).filter((image) => !text(record(image).uri)?.startsWith("data:image/"))];
  for (const uri of elsewhere.map((part) => text(record(part).uri))) {
    if (uri) throw new AvatarProblem(say("It is not all in one file"), say("it refers to \"{address}\"", { address: uri.slice(0, 60) }), say(AS_GLB));
  }
  const nodes = nodesOf(json);
  const told = toldBones(json);
  const bones = told ? new Map([...told.bones].filter(([, node]) => node in nodes)) : findBones(nodes);
  const gone = missing(bones);
  if (gone.length > 0) {
    const detail = bones.size === 0 ? say("no humanoid bones were found in it") : say("these bones were not found: {bones}", { bones: series(gone) });
    throw new AvatarProblem(say("It is no humanoid that can dance"), detail, say("Bones are known in VRM files, and by the names of Mixamo, VRoid, Unreal, Unity and H-Anim."));
  }
  if (list(json.meshes).length === 0) throw new AvatarProblem(say("There is nothing to see"), say("it has bones, but no mesh"), exportAgain());
  return { vrm: told !== null, name: told?.name ?? null, bones };
}

function descriptionOf(bytes: ArrayBuffer): unknown {
  const view = new DataView(bytes);
  if (bytes.byteLength < HEADER || view.getUint32(0, true) !== MAGIC) throw new AvatarProblem(say("It is no GLB"), say("it does not begin as binary glTF does"), say(AS_GLB));
  if (view.getUint32(4, true) !== 2) throw new AvatarProblem(say("It is of another age"), say("it is glTF of version {version}, and 2 is read here", { version: view.getUint32(4, true) }), exportAgain());
  if (bytes.byteLength < HEADER + CHUNK_HEADER || view.getUint32(8, true) > bytes.byteLength) throw broken(say("it ends before it should"));
  const length = view.getUint32(HEADER, true);
  const begin = HEADER + CHUNK_HEADER;
  if (view.getUint32(HEADER + 4, true) !== JSON_CHUNK || begin + length > bytes.byteLength) throw broken(say("its description is not where it should be"));
  try {
    return JSON.parse(new TextDecoder().decode(new Uint8Array(bytes, begin, length)));
  } catch {
    throw broken(say("its description cannot be read"));
  }
}

/** The bones that a VRM file itself names, of version 1 or 0; null where the file is none. */
function toldBones(json: Record<string, unknown>): { name: string | null; bones: Map<string, number> } | null {
  const extensions = record(json.extensions);
  if (extensions.VRMC_vrm) {
    const { meta, humanoid } = record(extensions.VRMC_vrm);
    const bones = Object.entries(record(record(humanoid).humanBones)).map(([bone, at]): [string, number] => [bone, Number(record(at).node)]);
    return { name: text(record(meta).name), bones: new Map(bones) };
  }
  if (extensions.VRM) {
    const { meta, humanoid } = record(extensions.VRM);
    const bones = list(record(humanoid).humanBones).map((at): [string, number] => [String(record(at).bone), Number(record(at).node)]);
    return { name: text(record(meta).title), bones: new Map(bones) };
  }
  return null;
}

function nodesOf(json: Record<string, unknown>): NamedNode[] {
  const nodes = list(json.nodes).map((node) => ({ name: text(record(node).name) ?? "", parent: -1 }));
  list(json.nodes).forEach((node, parent) => {
    for (const child of list(record(node).children)) if (nodes[Number(child)]) nodes[Number(child)].parent = parent;
  });
  return nodes;
}

function record(value: unknown): Record<string, unknown> {
  return typeof value === "object" && value !== null ? (value as Record<string, unknown>) : {};
}

function list(value: unknown): unknown[] {
  return Array.isArray(value) ? value : [];
}

function text(value: unknown): string | null {
  return typeof value === "string" && value.trim() ? value.trim() : null;
}
