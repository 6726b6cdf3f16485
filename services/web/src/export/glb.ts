/**
 * GLB export: the puppets, their joints under H-Anim names, and the animation, for Blender, viewers and game engines.
 */

import type { Placement } from "../motion/placement";
import { type Figure, JOINT_COUNT, JOINTS, PARENTS, type Pose, restPose } from "../motion/skeleton";
import { frameTimes, type GltfArray, GltfBuilder, writeRotation } from "./gltf";
import { FRAMES_PER_STEP, type IncrementalTask, poseAt, type SampledMotion } from "./sampled-motion";

/** The puppet of one performer as a mesh in its rest pose, and the movement of its two sleeves. */
export interface PuppetModel {
  /** Per vertex: position (metres), normal and colour (linear RGB). */
  positions: Float32Array<ArrayBuffer>;
  normals: Float32Array<ArrayBuffer>;
  colours: Float32Array<ArrayBuffer>;
  /** Per vertex: four joints (0-17) or sleeves (18, 19) and their weights. */
  bones: Uint8Array<ArrayBuffer>;
  weights: Float32Array<ArrayBuffer>;
  /** Per vertex: position on the face texture, from its upper left corner. */
  faceUvs: Float32Array<ArrayBuffer>;
  /** Triangles with the face texture, and all others. */
  face: Uint32Array<ArrayBuffer>;
  body: Uint32Array<ArrayBuffer>;
  /**
   * Write the sleeves' rotations (8, w x y z) in their shoulders' frames for `pose`, `seconds` after the last one; 0
   * for the first.
   */
  poseSleeves(pose: Pose, seconds: number, out: Float64Array): void;
}

const SHOULDERS = [JOINTS.indexOf("l_shoulder"), JOINTS.indexOf("r_shoulder")] as const;
const SLEEVES = ["l_sleeve", "r_sleeve"] as const;
const BONE_COUNT = JOINT_COUNT + SLEEVES.length;
const PBR_MATERIAL = { metallicFactor: 0, roughnessFactor: 0.6 };

/** A motion and its puppet; a model used several times is written once. */
export interface AnimatedPuppet {
  motion: SampledMotion;
  model: PuppetModel;
}

/**
 * Write all puppets as one scene with one animation of this name. Each hangs from its own node, "dancer 1" and so on,
 * at its placement on the stage; a single one at the centre needs none. `face` is the face texture as PNG; without it
 * faces are white.
 */
export function* writeGlb(
  puppets: readonly AnimatedPuppet[],
  name: string,
  face: Uint8Array<ArrayBuffer> | null,
): IncrementalTask<Uint8Array<ArrayBuffer>[]> {
  const asset = new GltfBuilder();
  const { bones, roots } = addPuppets(asset, puppets, face);
  for (const [index, puppet] of puppets.entries()) {
    for (const share of addAnimation(asset, bones[index], puppet)) yield (index + share) / puppets.length;
  }
  return asset.build(roots, name);
}

/** Animate the joints and sleeves, which are the nodes from `first` on. */
function* addAnimation(asset: GltfBuilder, first: number, { motion, model }: AnimatedPuppet): IncrementalTask<void> {
  const { fps, frames, roots } = motion;
  const rotations = Array.from({ length: BONE_COUNT }, () => new Float32Array(frames * 4));
  const pose = restPose(),
    sleeveRotations = new Float64Array(8);
  for (let frame = 0; frame < frames; frame++) {
    poseAt(motion, frame, pose);
    model.poseSleeves(pose, frame === 0 ? 0 : 1 / fps, sleeveRotations);
    for (let joint = 0; joint < JOINT_COUNT; joint++)
      writeRotation(rotations[joint], frame * 4, pose.rotations, joint * 4);
    for (let sleeve = 0; sleeve < SLEEVES.length; sleeve++)
      writeRotation(rotations[JOINT_COUNT + sleeve], frame * 4, sleeveRotations, sleeve * 4);
    if (frame % FRAMES_PER_STEP === 0) yield frame / frames;
  }
  const times = asset.addAccessor(frameTimes(frames, fps), "SCALAR", { bounded: true });
  asset.addChannel(first, "translation", times, Float32Array.from(roots));
  rotations.forEach((turn, bone) => asset.addChannel(first + bone, "rotation", times, turn));
}

/** Add the puppets at rest. Return the first bone's node of each, and the roots of the scene. */
function addPuppets(
  asset: GltfBuilder,
  puppets: readonly AnimatedPuppet[],
  face: Uint8Array<ArrayBuffer> | null,
): { bones: number[]; roots: number[] } {
  const { nodes } = asset;
  const meshes: object[] = [],
    skins: object[] = [],
    bones: number[] = [],
    roots: number[] = [];
  const shared = new Map<PuppetModel, { mesh: number; inverseBindMatrices: number }>();
  puppets.forEach(({ motion: { figure, placement: place }, model }, index) => {
    const first = nodes.length;
    const positions = addBones(asset, figure);
    let sharedParts = shared.get(model);
    if (!sharedParts) {
      sharedParts = {
        mesh: meshes.push(addMesh(asset, model)) - 1,
        inverseBindMatrices: addInverseBindMatrices(asset, positions),
      };
      shared.set(model, sharedParts);
    }
    const { mesh, inverseBindMatrices } = sharedParts;
    skins.push({
      joints: Array.from({ length: BONE_COUNT }, (_, bone) => first + bone),
      skeleton: first,
      inverseBindMatrices,
    });
    const needsNode = puppets.length > 1 || place.x !== 0 || place.z !== 0 || place.turn !== 0;
    // A skin moves its mesh by the bones alone, so the mesh has no parent.
    const puppet = nodes.push({ name: needsNode ? `puppet ${index + 1}` : "puppet", mesh, skin: index }) - 1;
    roots.push(needsNode ? addPlacementNode(asset, `dancer ${index + 1}`, place, first) : first, puppet);
    bones.push(first);
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
  return { bones, roots };
}

/**
 * Add the joints and sleeves of a figure as nodes at rest. Return their positions relative to the figure's origin (60),
 * in metres.
 */
function addBones({ nodes }: GltfBuilder, { offsets }: Figure): Float64Array {
  const first = nodes.length;
  const places = new Float64Array(BONE_COUNT * 3);
  JOINTS.forEach((name, joint) => {
    const children = PARENTS.flatMap((parent, child) => (parent === joint ? [first + child] : []));
    SHOULDERS.forEach((shoulder, sleeve) => shoulder === joint && children.push(first + JOINT_COUNT + sleeve));
    nodes.push({
      name,
      translation: [...offsets.subarray(joint * 3, joint * 3 + 3)],
      ...(children.length > 0 ? { children } : {}),
    });
    for (let axis = 0; axis < 3; axis++)
      places[joint * 3 + axis] = offsets[joint * 3 + axis] + (joint > 0 ? places[PARENTS[joint] * 3 + axis] : 0);
  });
  SLEEVES.forEach((name, sleeve) => {
    nodes.push({ name });
    places.copyWithin((JOINT_COUNT + sleeve) * 3, SHOULDERS[sleeve] * 3, SHOULDERS[sleeve] * 3 + 3);
  });
  return places;
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

/** Return the puppet's mesh, for skins with its bones. */
function addMesh(asset: GltfBuilder, model: PuppetModel): object {
  const vertices = (values: GltfArray, type: "VEC2" | "VEC3" | "VEC4", bounded = false) =>
    asset.addAccessor(values, type, { target: "vertices", bounded });
  const attributes = {
    POSITION: vertices(model.positions, "VEC3", true),
    NORMAL: vertices(model.normals, "VEC3"),
    COLOR_0: vertices(model.colours, "VEC3"),
    TEXCOORD_0: vertices(model.faceUvs, "VEC2"),
    JOINTS_0: vertices(model.bones, "VEC4"),
    WEIGHTS_0: vertices(model.weights, "VEC4"),
  };
  const primitives = [model.body, model.face].map((triangles, material) => ({
    attributes,
    material,
    indices: asset.addAccessor(triangles, "SCALAR", { target: "indices" }),
  }));
  return { name: "figure", primitives };
}

/** Add the matrices from the mesh to the frames of the bones at rest. Return the accessor's index. */
function addInverseBindMatrices(asset: GltfBuilder, places: Float64Array): number {
  const matrices = new Float32Array(BONE_COUNT * 16);
  for (let bone = 0; bone < BONE_COUNT; bone++) {
    for (let i = 0; i < 4; i++) matrices[bone * 16 + i * 5] = 1;
    for (let axis = 0; axis < 3; axis++) matrices[bone * 16 + 12 + axis] = -places[bone * 3 + axis];
  }
  return asset.addAccessor(matrices, "MAT4");
}
