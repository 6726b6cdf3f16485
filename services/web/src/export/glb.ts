/** Motion as GLB: the puppets themselves, their joints under their H-Anim names, and the dance. For Blender, viewers and engines. */

import type { Place } from "../motion/performer";
import { type Figure, JOINT_COUNT, JOINTS, PARENTS, type Pose, restPose } from "../motion/skeleton";
import { type Dance, poseOf, STRIDE, type Work } from "./dance";
import { frameTimes, Gltf, putRotation, type Values } from "./gltf";

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
  facing: Float32Array<ArrayBuffer>;
  /** Triangles that the face's picture is painted on, and all others. */
  face: Uint32Array<ArrayBuffer>;
  body: Uint32Array<ArrayBuffer>;
  /** The sleeves' turns (8, w x y z) in their shoulders' frames as `pose` is taken `seconds` after the one before, 0 for the first. */
  hang(pose: Pose, seconds: number, out: Float64Array): void;
}

const SHOULDERS = [JOINTS.indexOf("l_shoulder"), JOINTS.indexOf("r_shoulder")] as const;
const SLEEVES = ["l_sleeve", "r_sleeve"] as const;
const BONE_COUNT = JOINT_COUNT + SLEEVES.length;
const MATERIAL = { metallicFactor: 0, roughnessFactor: 0.6 };

/** A dance, and who is seen to dance it; where one model dances several, its mesh is written once. */
export interface Danced {
  dance: Dance;
  model: PuppetModel;
}

/**
 * All of `danced` as one scene and one animation of this `name`. Each hangs from a node of its own, "dancer 1" and so on, which
 * stands in its place on the stage; one alone in the middle needs none. `face` is the picture of their faces, PNG, white without.
 */
export function* writeGlb(danced: readonly Danced[], name: string, face: Uint8Array<ArrayBuffer> | null): Work<Uint8Array<ArrayBuffer>[]> {
  const asset = new Gltf();
  const { bones, roots } = addPuppets(asset, danced, face);
  for (const [nth, one] of danced.entries()) {
    for (const share of animate(asset, bones[nth], one)) yield (nth + share) / danced.length;
  }
  return asset.file(roots, name);
}

/** Has the joints and sleeves that are the nodes from `first` on dance. */
function* animate(asset: Gltf, first: number, { dance, model }: Danced): Work<void> {
  const { fps, frames, roots } = dance;
  const turns = Array.from({ length: BONE_COUNT }, () => new Float32Array(frames * 4));
  const pose = restPose(), hanging = new Float64Array(8);
  for (let frame = 0; frame < frames; frame++) {
    poseOf(dance, frame, pose);
    model.hang(pose, frame === 0 ? 0 : 1 / fps, hanging);
    for (let joint = 0; joint < JOINT_COUNT; joint++) putRotation(turns[joint], frame * 4, pose.rotations, joint * 4);
    for (let sleeve = 0; sleeve < SLEEVES.length; sleeve++) putRotation(turns[JOINT_COUNT + sleeve], frame * 4, hanging, sleeve * 4);
    if (frame % STRIDE === 0) yield frame / frames;
  }
  const times = asset.accessor(frameTimes(frames, fps), "SCALAR", { bounded: true });
  asset.animate(first, "translation", times, Float32Array.from(roots));
  turns.forEach((turn, bone) => asset.animate(first + bone, "rotation", times, turn));
}

/** Puts up the puppets at rest. The first node of each one's bones, and the roots of the scene. */
function addPuppets(asset: Gltf, danced: readonly Danced[], face: Uint8Array<ArrayBuffer> | null): { bones: number[]; roots: number[] } {
  const { nodes } = asset;
  const meshes: object[] = [], skins: object[] = [], bones: number[] = [], roots: number[] = [];
  const made = new Map<PuppetModel, { mesh: number; inverseBindMatrices: number }>();
  danced.forEach(({ dance: { figure, place }, model }, nth) => {
    const first = nodes.length;
    const at = addBones(asset, figure);
    let shape = made.get(model);
    if (!shape) {
      shape = { mesh: meshes.push(addMesh(asset, model)) - 1, inverseBindMatrices: addUnbinding(asset, at) };
      made.set(model, shape);
    }
    const { mesh, inverseBindMatrices } = shape;
    skins.push({ joints: Array.from({ length: BONE_COUNT }, (_, bone) => first + bone), skeleton: first, inverseBindMatrices });
    const placed = danced.length > 1 || place.x !== 0 || place.z !== 0 || place.turn !== 0;
    // a skin moves its mesh by the bones alone, so the mesh hangs from nothing
    const puppet = nodes.push({ name: placed ? `puppet ${nth + 1}` : "puppet", mesh, skin: nth }) - 1;
    roots.push(placed ? addPlace(asset, `dancer ${nth + 1}`, place, first) : first, puppet);
    bones.push(first);
  });
  const painted = face ? { baseColorTexture: { index: 0 } } : {};
  Object.assign(asset.more, {
    meshes,
    materials: [{ name: "figure", pbrMetallicRoughness: MATERIAL }, { name: "face", pbrMetallicRoughness: { ...MATERIAL, ...painted } }],
    skins,
    ...(face ? { textures: [{ source: 0 }], images: [{ bufferView: asset.view(face), mimeType: "image/png" }] } : {}),
  });
  return { bones, roots };
}

/** The joints and sleeves of a dancer as nodes at rest; where they are from the dancer's own middle (60), metres. */
function addBones({ nodes }: Gltf, { offsets }: Figure): Float64Array {
  const first = nodes.length;
  const places = new Float64Array(BONE_COUNT * 3);
  JOINTS.forEach((name, joint) => {
    const children = PARENTS.flatMap((parent, child) => (parent === joint ? [first + child] : []));
    SHOULDERS.forEach((shoulder, sleeve) => shoulder === joint && children.push(first + JOINT_COUNT + sleeve));
    nodes.push({ name, translation: [...offsets.subarray(joint * 3, joint * 3 + 3)], ...(children.length > 0 ? { children } : {}) });
    for (let axis = 0; axis < 3; axis++) places[joint * 3 + axis] = offsets[joint * 3 + axis] + (joint > 0 ? places[PARENTS[joint] * 3 + axis] : 0);
  });
  SLEEVES.forEach((name, sleeve) => {
    nodes.push({ name });
    places.copyWithin((JOINT_COUNT + sleeve) * 3, SHOULDERS[sleeve] * 3, SHOULDERS[sleeve] * 3 + 3);
  });
  return places;
}

/** A node in `place` that node `child` hangs from; its index. */
function addPlace({ nodes }: Gltf, name: string, { x, z, turn }: Place, child: number): number {
  return nodes.push({ name, translation: [x, 0, z], rotation: [0, Math.sin(turn / 2), 0, Math.cos(turn / 2)], children: [child] }) - 1;
}

/** The puppet's mesh, for skins of its bones. */
function addMesh(asset: Gltf, model: PuppetModel): object {
  const vertices = (values: Values, type: "VEC2" | "VEC3" | "VEC4", bounded = false) => asset.accessor(values, type, { target: "vertices", bounded });
  const attributes = {
    POSITION: vertices(model.positions, "VEC3", true), NORMAL: vertices(model.normals, "VEC3"), COLOR_0: vertices(model.colours, "VEC3"),
    TEXCOORD_0: vertices(model.facing, "VEC2"), JOINTS_0: vertices(model.bones, "VEC4"), WEIGHTS_0: vertices(model.weights, "VEC4"),
  };
  const primitives = [model.body, model.face].map((triangles, material) => ({ attributes, material, indices: asset.accessor(triangles, "SCALAR", { target: "indices" }) }));
  return { name: "figure", primitives };
}

/** Index of an accessor of what brings a mesh into the frames of bones that stand at `places` at rest. */
function addUnbinding(asset: Gltf, places: Float64Array): number {
  const unbind = new Float32Array(BONE_COUNT * 16);
  for (let bone = 0; bone < BONE_COUNT; bone++) {
    for (let i = 0; i < 4; i++) unbind[bone * 16 + i * 5] = 1;
    for (let axis = 0; axis < 3; axis++) unbind[bone * 16 + 12 + axis] = -places[bone * 3 + axis];
  }
  return asset.accessor(unbind, "MAT4");
}
