/**
 * GLB export: the puppets, their joints under H-Anim names, and the animation, for Blender, viewers and game engines.
 */

import { CLAVICLE_NAMES, NECK_NAME, type StagedPose } from "../motion/extension";
import type { Placement } from "../motion/placement";
import { type Figure, JOINTS, restPose } from "../motion/skeleton";
import { ExportSkeleton } from "./export-skeleton";
import { addFaceChannel, createHeadMesh, type PuppetHead, targetNames } from "./glb-face";
import { addProps, type ExportedProps, PerformerPath } from "./glb-props";
import { frameTimes, type GltfArray, GltfBuilder, writeRotation } from "./gltf";
import { FRAMES_PER_STEP, frameValuesAt, type IncrementalTask, poseAt, type SampledMotion } from "./sampled-motion";

/** The puppet of one performer as a mesh in its rest pose, and the movement of its two sleeves. */
export interface PuppetModel {
  /** Per vertex: position (metres), normal and colour (linear RGB). */
  positions: Float32Array<ArrayBuffer>;
  normals: Float32Array<ArrayBuffer>;
  colours: Float32Array<ArrayBuffer>;
  /** Per vertex: four bones, (the figure's joints, its sleeves, then chest, neck and clavicles), and their weights. */
  bones: Uint8Array<ArrayBuffer>;
  weights: Float32Array<ArrayBuffer>;
  /** Per vertex: position on the face texture, from its upper left corner. */
  faceUvs: Float32Array<ArrayBuffer>;
  /** Triangles with the face texture, and all others. */
  face: Uint32Array<ArrayBuffer>;
  body: Uint32Array<ArrayBuffer>;
  /** Height of the balls of the feet above the floor, metres. */
  soleHeight: number;
  /** Return the head as a mesh of its own, and the triangles of all other parts. */
  separateHead(): { head: PuppetHead; rest: Uint32Array<ArrayBuffer> };
  /**
   * Write the sleeves' rotations (8, w x y z) in their shoulders' frames for `pose`, `seconds` after the last one; 0
   * for the first.
   */
  poseSleeves(pose: StagedPose, seconds: number, out: Float64Array): void;
}

const SHOULDERS = ["l_shoulder", "r_shoulder"] as const;
const SLEEVES = ["l_sleeve", "r_sleeve"] as const;
const PBR_MATERIAL = { metallicFactor: 0, roughnessFactor: 0.6 };

/** A motion and its puppet; a model used several times is written once. */
export interface AnimatedPuppet {
  motion: SampledMotion;
  model: PuppetModel;
}

/**
 * Write all puppets as one scene with one animation of this name. Each hangs from its own node, "dancer 1" and so on,
 * at its placement on the stage; a single one at the centre needs none. `face` is the face texture as PNG; without it
 * faces are white. The heads of those whose motion has a face are meshes with morph targets. Props are nodes of their
 * own.
 */
export function* writeGlb(
  puppets: readonly AnimatedPuppet[],
  name: string,
  face: Uint8Array<ArrayBuffer> | null,
  props: ExportedProps | null = null,
): IncrementalTask<Uint8Array<ArrayBuffer>[]> {
  const asset = new GltfBuilder();
  const { meshes, bones, faces, roots } = addPuppets(asset, puppets, face);
  const paths: PerformerPath[] = [];
  for (const [index, puppet] of puppets.entries()) {
    const { motion, model } = puppet;
    const skeleton = skeletonOf(motion);
    const path = new PerformerPath(skeleton, motion, model.soleHeight);
    paths.push(path);
    for (const share of addAnimation(asset, bones[index], faces[index], puppet, skeleton, path))
      yield (index + share) / puppets.length;
  }
  if (props) roots.push(...addProps(asset, meshes, props, paths, puppets[0].motion));
  return asset.build(roots, name);
}

function skeletonOf({ figure, extension, hands }: SampledMotion): ExportSkeleton {
  return new ExportSkeleton(figure, extension?.extension, hands?.hands);
}

/**
 * Animate the joints and sleeves, which are the nodes from `first` on, and the node of the face, if there is one.
 * Record the path of hands and feet.
 */
function* addAnimation(
  asset: GltfBuilder,
  first: number,
  face: number | undefined,
  { motion, model }: AnimatedPuppet,
  skeleton: ExportSkeleton,
  path: PerformerPath,
): IncrementalTask<void> {
  const { fps, frames, roots } = motion;
  const rotations = Array.from({ length: skeleton.count + SLEEVES.length }, () => new Float32Array(frames * 4));
  const pose: StagedPose = restPose();
  const sleeveRotations = new Float64Array(8),
    jointRotations = new Float64Array(skeleton.count * 4);
  for (let frame = 0; frame < frames; frame++) {
    const values = frameValuesAt(motion, frame);
    skeleton.rotations(poseAt(motion, frame, pose), values, jointRotations);
    pose.extended = skeleton.extend(pose, values.extension);
    model.poseSleeves(pose, frame === 0 ? 0 : 1 / fps, sleeveRotations);
    path.record(frame, pose.root, jointRotations);
    for (let joint = 0; joint < skeleton.count; joint++)
      writeRotation(rotations[joint], frame * 4, jointRotations, joint * 4);
    for (let sleeve = 0; sleeve < SLEEVES.length; sleeve++)
      writeRotation(rotations[skeleton.count + sleeve], frame * 4, sleeveRotations, sleeve * 4);
    if (frame % FRAMES_PER_STEP === 0) yield frame / frames;
  }
  const times = asset.addAccessor(frameTimes(frames, fps), "SCALAR", { bounded: true });
  asset.addChannel(first, "translation", times, Float32Array.from(roots));
  rotations.forEach((turn, bone) => asset.addChannel(first + bone, "rotation", times, turn));
  if (face !== undefined) addFaceChannel(asset, face, motion, times);
}

/** Skin of a puppet: the joints that move its mesh, by index in the skeleton, and where the mesh has them at rest. */
interface PuppetSkin {
  joints: number[];
  /** Positions [joint][3] in metres. */
  places: number[];
  /** Joint of the skin for each bone of the mesh. */
  skinOf: number[];
}

/** Add the puppets at rest. Return the nodes of the first bone and of the face of each, and the roots of the scene. */
function addPuppets(
  asset: GltfBuilder,
  puppets: readonly AnimatedPuppet[],
  face: Uint8Array<ArrayBuffer> | null,
): { meshes: object[]; bones: number[]; faces: (number | undefined)[]; roots: number[] } {
  const { nodes } = asset;
  const meshes: object[] = [],
    skins: object[] = [],
    bones: number[] = [],
    faces: (number | undefined)[] = [],
    roots: number[] = [];
  const shared = new Map<PuppetModel, Map<string, SharedParts>>();
  puppets.forEach(({ motion, model }, index) => {
    const { figure, placement: place } = motion;
    const first = nodes.length;
    const skeleton = skeletonOf(motion);
    addBones(asset, skeleton);
    const skin = createSkin(figure, skeleton);
    const variants = shared.get(model) ?? new Map<string, SharedParts>();
    shared.set(model, variants);
    const key = skin.places.join();
    const common: SharedParts = variants.get(key) ?? {
      attributes: addAttributes(asset, model, skin),
      parts: new Map(),
    };
    variants.set(key, common);
    const targets = targetNames(motion);
    const parts = common.parts.get(targets.join()) ?? addParts(asset, meshes, common, model, skin, targets);
    common.parts.set(targets.join(), parts);
    common.inverseBindMatrices ??= addInverseBindMatrices(asset, skin);
    skins.push({
      joints: skin.joints.map((joint) => first + joint),
      skeleton: first,
      inverseBindMatrices: common.inverseBindMatrices,
    });
    const needsNode = puppets.length > 1 || place.x !== 0 || place.z !== 0 || place.turn !== 0;
    // A skin moves its mesh by the bones alone, so the mesh has no parent.
    const name = needsNode ? `puppet ${index + 1}` : "puppet";
    const puppet = nodes.push({ name, mesh: parts.mesh, skin: index }) - 1;
    roots.push(needsNode ? addPlacementNode(asset, `dancer ${index + 1}`, place, first) : first, puppet);
    bones.push(first);
    const faceName = needsNode ? `face ${index + 1}` : "face";
    // A mesh of its own, since three.js finds the morph targets of an animation by the mesh's name.
    const head = parts.head && nodes.push({ name: faceName, mesh: meshes.push(parts.head) - 1, skin: index }) - 1;
    if (head) roots.push(head);
    faces.push(head);
  });
  const painted = face ? { baseColorTexture: { index: 0 } } : {};
  Object.assign(asset.extraProperties, {
    meshes,
    materials: [
      { name: "figure", pbrMetallicRoughness: PBR_MATERIAL },
      { name: "face", pbrMetallicRoughness: { ...PBR_MATERIAL, ...painted } },
    ],
    skins,
    ...(face
      ? { textures: [{ source: 0 }], images: [{ bufferView: asset.addBufferView(face), mimeType: "image/png" }] }
      : {}),
  });
  return { meshes, bones, faces, roots };
}

/** Mesh of a puppet, and that of its head, if it has morph targets. */
interface PuppetParts {
  mesh: number;
  head: object | undefined;
}

/** Accessors that puppets of one model and skin share, and their meshes by the names of the morph targets. */
interface SharedParts {
  attributes: Record<string, number>;
  inverseBindMatrices?: number;
  parts: Map<string, PuppetParts>;
}

function addParts(
  asset: GltfBuilder,
  meshes: object[],
  { attributes }: SharedParts,
  model: PuppetModel,
  { skinOf }: PuppetSkin,
  targets: readonly string[],
): PuppetParts {
  const separate = targets.length > 0 ? model.separateHead() : null;
  const triangles = separate ? [separate.rest] : [model.body, model.face];
  const primitives = triangles.map((indices, material) => ({
    attributes,
    material,
    indices: asset.addAccessor(indices, "SCALAR", { target: "indices" }),
  }));
  const skull = skinOf[JOINTS.indexOf("skullbase")];
  return {
    mesh: meshes.push({ name: "figure", primitives }) - 1,
    head: separate ? createHeadMesh(asset, separate.head, skull, targets) : undefined,
  };
}

/** Add the joints of a skeleton and the sleeves as nodes at rest. */
function addBones({ nodes }: GltfBuilder, { names, parents, offsets, count }: ExportSkeleton): void {
  const first = nodes.length;
  names.forEach((name, joint) => {
    const children = parents.flatMap((parent, child) => (parent === joint ? [first + child] : []));
    SHOULDERS.forEach((shoulder, sleeve) => shoulder === name && children.push(first + count + sleeve));
    nodes.push({
      name,
      translation: [...offsets.subarray(joint * 3, joint * 3 + 3)],
      ...(children.length > 0 ? { children } : {}),
    });
  });
  for (const name of SLEEVES) nodes.push({ name });
}

/**
 * Return the skin of a puppet's mesh. Limbs and head are bound where the mesh has them, which is where the figure does.
 * A bone of the trunk, which an extension gives other lengths, carries one point of the mesh to its place: the neck the
 * base of the head, a clavicle the shoulder, the chest the middle of the shoulders. Fingers are bones of the skin, but
 * move nothing of the mesh, whose hands are rigid.
 */
function createSkin(figure: Figure, skeleton: ExportSkeleton): PuppetSkin {
  const rest = skeleton.restPositions(),
    figureRest = new ExportSkeleton(figure).restPositions();
  const vl5 = skeleton.indexOf("vl5");
  const bends = skeleton.hasExtension && skeleton.chest > 0;
  const chest = bends ? skeleton.chest : vl5;
  const orChest = (name: string) => (skeleton.indexOf(name) < 0 ? chest : skeleton.indexOf(name));
  const trunk = [
    { joint: chest, carried: SHOULDERS },
    { joint: orChest(NECK_NAME), carried: ["skullbase"] },
    { joint: orChest(CLAVICLE_NAMES[0]), carried: [SHOULDERS[0]] },
    { joint: orChest(CLAVICLE_NAMES[1]), carried: [SHOULDERS[1]] },
  ];
  const skin: PuppetSkin = { joints: [], places: [], skinOf: [] };
  const add = (joint: number, place: (axis: number) => number) => {
    const known = skin.joints.indexOf(joint);
    skin.skinOf.push(known < 0 ? skin.joints.push(joint) - 1 : known);
    if (known < 0) skin.places.push(place(0), place(1), place(2));
  };
  JOINTS.forEach((name, joint) => {
    const own = skeleton.indexOf(name);
    const isTrunk = bends && name === "vl5";
    add(own, (axis) => (isTrunk ? rest[own * 3 + axis] : figureRest[joint * 3 + axis]));
  });
  SLEEVES.forEach((_, sleeve) =>
    add(skeleton.count + sleeve, (axis) => figureRest[JOINTS.indexOf(SHOULDERS[sleeve]) * 3 + axis]),
  );
  for (const { joint, carried } of trunk) {
    add(joint, (axis) => {
      const moved = carried.map(
        (name) => figureRest[JOINTS.indexOf(name) * 3 + axis] - rest[skeleton.indexOf(name) * 3 + axis],
      );
      return rest[joint * 3 + axis] + moved.reduce((sum, value) => sum + value, 0) / moved.length;
    });
  }
  for (const joint of skeleton.fingerJoints) {
    const wrist = skeleton.wristOf(joint);
    const moved = (axis: number) => skin.places[skin.joints.indexOf(wrist) * 3 + axis] - rest[wrist * 3 + axis];
    skin.places.push(...[0, 1, 2].map((axis) => rest[joint * 3 + axis] + moved(axis)));
    skin.joints.push(joint);
  }
  return skin;
}

/** Add a node at `placement` with one child. Return its index. */
function addPlacementNode({ nodes }: GltfBuilder, name: string, { x, z, turn }: Placement, child: number): number {
  return (
    nodes.push({
      name,
      translation: [x, 0, z],
      rotation: [0, Math.sin(turn / 2), 0, Math.cos(turn / 2)],
      children: [child],
    }) - 1
  );
}

/** Add the vertices of a puppet's mesh for a skin. Return their accessors. */
function addAttributes(asset: GltfBuilder, model: PuppetModel, { skinOf }: PuppetSkin): Record<string, number> {
  const vertices = (values: GltfArray, type: "VEC2" | "VEC3" | "VEC4", bounded = false) =>
    asset.addAccessor(values, type, { target: "vertices", bounded });
  const { joints, weights } = mergeWeights(model, skinOf);
  return {
    POSITION: vertices(model.positions, "VEC3", true),
    NORMAL: vertices(model.normals, "VEC3"),
    COLOR_0: vertices(model.colours, "VEC3"),
    TEXCOORD_0: vertices(model.faceUvs, "VEC2"),
    JOINTS_0: vertices(joints, "VEC4"),
    WEIGHTS_0: vertices(weights, "VEC4"),
  };
}

/** Return the joints of the vertices and their weights; a vertex has each joint once (glTF 2.0, 3.7.3.3). */
function mergeWeights(model: PuppetModel, skinOf: readonly number[]) {
  const joints = model.bones.map((bone) => skinOf[bone]);
  const weights = model.weights.slice();
  for (let at = 0; at < joints.length; at++) {
    const first = joints.indexOf(joints[at], at - (at % 4));
    if (first < at) {
      weights[first] += weights[at];
      weights[at] = 0;
    }
    if (weights[at] === 0) joints[at] = 0;
  }
  return { joints, weights };
}

/** Add the matrices from the mesh to the frames of the bones at rest. Return the accessor's index. */
function addInverseBindMatrices(asset: GltfBuilder, { joints, places }: PuppetSkin): number {
  const matrices = new Float32Array(joints.length * 16);
  for (let bone = 0; bone < joints.length; bone++) {
    for (let i = 0; i < 4; i++) matrices[bone * 16 + i * 5] = 1;
    for (let axis = 0; axis < 3; axis++) matrices[bone * 16 + 12 + axis] = -places[bone * 3 + axis];
  }
  return asset.addAccessor(matrices, "MAT4");
}
