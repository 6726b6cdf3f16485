/** Motion as GLB: the puppets themselves, their joints under their H-Anim names, and the dance. For Blender, viewers and engines. */

import type { Placement } from "../motion/placement";
import { type Figure, JOINT_COUNT, JOINTS, PARENTS, type Pose, restPose } from "../motion/skeleton";
import { frameTimes, type GltfArray, GltfBuilder, writeRotation } from "./gltf";
import { FRAMES_PER_STEP, type IncrementalTask, poseAt, type SampledMotion } from "./sampled-motion";

/** The puppet of one dancer as a mesh in its rest pose, and how its two sleeves hang. */
export interface PuppetModel {
  /** Of each vertex the place (metres), the normal and the colour (linear RGB). */
  positions: Float32Array<ArrayBuffer>;
  normals: Float32Array<ArrayBuffer>;
  colours: Float32Array<ArrayBuffer>;
  /** Of each vertex four of the joints (0-17) and sleeves (18, 19), and their weights. */
  bones: Uint8Array<ArrayBuffer>;
  weights: Float32Array<ArrayBuffer>;
  /** Of each vertex the place on the face's picture, from its upper left corner. */
  faceUvs: Float32Array<ArrayBuffer>;
  /** Triangles that the face's picture is painted on, and all others. */
  face: Uint32Array<ArrayBuffer>;
  body: Uint32Array<ArrayBuffer>;
  /** The sleeves' turns (8, w x y z) in their shoulders' frames as `pose` is taken `seconds` after the one before, 0 for the first. */
  poseSleeves(pose: Pose, seconds: number, out: Float64Array): void;
}

const SHOULDERS = [JOINTS.indexOf("l_shoulder"), JOINTS.indexOf("r_shoulder")] as const;
const SLEEVES = ["l_sleeve", "r_sleeve"] as const;
const BONE_COUNT = JOINT_COUNT + SLEEVES.length;
const PBR_MATERIAL = { metallicFactor: 0, roughnessFactor: 0.6 };

/** A dance, and who is seen to dance it; where one model dances several, its mesh is written once. */
export interface AnimatedPuppet {
  motion: SampledMotion;
  model: PuppetModel;
}

/**
 * All of `danced` as one scene and one animation of this `name`. Each hangs from a node of its own, "dancer 1" and so on, which
 * stands in its place on the stage; one alone in the middle needs none. `face` is the picture of their faces, PNG, white without.
 */
export function* writeGlb(
  puppets: readonly AnimatedPuppet[],
  name: string,
  face: Uint8Array<ArrayBuffer> | null,
): IncrementalTask<Uint8Array<ArrayBuffer>[]> {
  const asset = new GltfBuilder();
  const { bones, roots } = addPuppets(asset, puppets, face);
  for (const [nth, one] of puppets.entries()) {
    for (const share of addAnimation(asset, bones[nth], one)) yield (nth + share) / puppets.length;
  }
  return asset.build(roots, name);
}

/** Has the joints and sleeves that are the nodes from `first` on dance. */
function* addAnimation(
  asset: GltfBuilder,
  first: number,
  { motion: dance, model }: AnimatedPuppet,
): IncrementalTask<void> {
  const { fps, frames, roots } = dance;
  const turns = Array.from({ length: BONE_COUNT }, () => new Float32Array(frames * 4));
  const pose = restPose(),
    hanging = new Float64Array(8);
  for (let frame = 0; frame < frames; frame++) {
    poseAt(dance, frame, pose);
    model.poseSleeves(pose, frame === 0 ? 0 : 1 / fps, hanging);
    for (let joint = 0; joint < JOINT_COUNT; joint++) writeRotation(turns[joint], frame * 4, pose.rotations, joint * 4);
    for (let sleeve = 0; sleeve < SLEEVES.length; sleeve++)
      writeRotation(turns[JOINT_COUNT + sleeve], frame * 4, hanging, sleeve * 4);
    if (frame % FRAMES_PER_STEP === 0) yield frame / frames;
  }
  const times = asset.addAccessor(frameTimes(frames, fps), "SCALAR", { bounded: true });
  asset.addChannel(first, "translation", times, Float32Array.from(roots));
  turns.forEach((turn, bone) => asset.addChannel(first + bone, "rotation", times, turn));
}

/** Puts up the puppets at rest. The first node of each one's bones, and the roots of the scene. */
function addPuppets(
  asset: GltfBuilder,
  danced: readonly AnimatedPuppet[],
  face: Uint8Array<ArrayBuffer> | null,
): { bones: number[]; roots: number[] } {
  const { nodes } = asset;
  const meshes: object[] = [],
    skins: object[] = [],
    bones: number[] = [],
    roots: number[] = [];
  const made = new Map<PuppetModel, { mesh: number; inverseBindMatrices: number }>();
  danced.forEach(({ motion: { figure, placement: place }, model }, nth) => {
    const first = nodes.length;
    const at = addBones(asset, figure);
    let shape = made.get(model);
    if (!shape) {
      shape = { mesh: meshes.push(addMesh(asset, model)) - 1, inverseBindMatrices: addInverseBindMatrices(asset, at) };
      made.set(model, shape);
    }
    const { mesh, inverseBindMatrices } = shape;
    skins.push({
      joints: Array.from({ length: BONE_COUNT }, (_, bone) => first + bone),
      skeleton: first,
      inverseBindMatrices,
    });
    const placed = danced.length > 1 || place.x !== 0 || place.z !== 0 || place.turn !== 0;
    // a skin moves its mesh by the bones alone, so the mesh hangs from nothing
    const puppet = nodes.push({ name: placed ? `puppet ${nth + 1}` : "puppet", mesh, skin: nth }) - 1;
    roots.push(placed ? addPlacementNode(asset, `dancer ${nth + 1}`, place, first) : first, puppet);
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

/** The joints and sleeves of a dancer as nodes at rest; where they are from the dancer's own middle (60), metres. */
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

/** A node in `place` that node `child` hangs from; its index. */
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

/** The puppet's mesh, for skins of its bones. */
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

/** Index of an accessor of what brings a mesh into the frames of bones that stand at `places` at rest. */
function addInverseBindMatrices(asset: GltfBuilder, places: Float64Array): number {
  const unbind = new Float32Array(BONE_COUNT * 16);
  for (let bone = 0; bone < BONE_COUNT; bone++) {
    for (let i = 0; i < 4; i++) unbind[bone * 16 + i * 5] = 1;
    for (let axis = 0; axis < 3; axis++) unbind[bone * 16 + 12 + axis] = -places[bone * 3 + axis];
  }
  return asset.addAccessor(unbind, "MAT4");
}
