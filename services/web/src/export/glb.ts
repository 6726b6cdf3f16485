/** Motion as GLB: the puppet itself, its joints under their H-Anim names, and the dance. For Blender, viewers and engines. */

import { JOINT_COUNT, JOINTS, PARENTS, type Pose, restPose } from "../motion/skeleton";
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
const MATERIAL = { metallicFactor: 0, roughnessFactor: 0.6 };

/** `dance` of this `name`, danced by `model`; `face` is the picture of its face, PNG, white without. */
export function* writeGlb(dance: Dance, name: string, model: PuppetModel, face: Uint8Array<ArrayBuffer> | null): Work<Uint8Array<ArrayBuffer>[]> {
  const { fps, frames, roots } = dance;
  const asset = new Gltf();
  const places = addBones(asset, dance);
  const mesh = addMesh(asset, places, model, face);
  const turns = Array.from({ length: JOINT_COUNT + SLEEVES.length }, () => new Float32Array(frames * 4));
  const pose = restPose(), hanging = new Float64Array(8);
  for (let frame = 0; frame < frames; frame++) {
    poseOf(dance, frame, pose);
    model.hang(pose, frame === 0 ? 0 : 1 / fps, hanging);
    for (let joint = 0; joint < JOINT_COUNT; joint++) putRotation(turns[joint], frame * 4, pose.rotations, joint * 4);
    for (let sleeve = 0; sleeve < SLEEVES.length; sleeve++) putRotation(turns[JOINT_COUNT + sleeve], frame * 4, hanging, sleeve * 4);
    if (frame % STRIDE === 0) yield frame / frames;
  }
  const times = asset.accessor(frameTimes(frames, fps), "SCALAR", { bounded: true });
  asset.animate(0, "translation", times, Float32Array.from(roots));
  turns.forEach((turn, bone) => asset.animate(bone, "rotation", times, turn));
  return asset.file([0, mesh], name);
}

/** The joints and sleeves as nodes at rest; their places in the world (60), metres. */
function addBones({ nodes }: Gltf, { figure }: Dance): Float64Array {
  const { offsets } = figure;
  const places = new Float64Array((JOINT_COUNT + SLEEVES.length) * 3);
  JOINTS.forEach((name, joint) => {
    const children = PARENTS.flatMap((parent, child) => (parent === joint ? [child] : []));
    SHOULDERS.forEach((shoulder, sleeve) => shoulder === joint && children.push(JOINT_COUNT + sleeve));
    nodes.push({ name, translation: [...offsets.subarray(joint * 3, joint * 3 + 3)], ...(children.length > 0 ? { children } : {}) });
    for (let axis = 0; axis < 3; axis++) places[joint * 3 + axis] = offsets[joint * 3 + axis] + (joint > 0 ? places[PARENTS[joint] * 3 + axis] : 0);
  });
  SLEEVES.forEach((name, sleeve) => {
    nodes.push({ name });
    places.copyWithin((JOINT_COUNT + sleeve) * 3, SHOULDERS[sleeve] * 3, SHOULDERS[sleeve] * 3 + 3);
  });
  return places;
}

/** The mesh on its bones, which stand at `places` at rest; the node's index. */
function addMesh(asset: Gltf, places: Float64Array, model: PuppetModel, face: Uint8Array<ArrayBuffer> | null): number {
  const bones = places.length / 3;
  const unbind = new Float32Array(bones * 16);
  for (let bone = 0; bone < bones; bone++) {
    for (let i = 0; i < 4; i++) unbind[bone * 16 + i * 5] = 1;
    for (let axis = 0; axis < 3; axis++) unbind[bone * 16 + 12 + axis] = -places[bone * 3 + axis];
  }
  const vertices = (values: Values, type: "VEC2" | "VEC3" | "VEC4", bounded = false) => asset.accessor(values, type, { target: "vertices", bounded });
  const attributes = {
    POSITION: vertices(model.positions, "VEC3", true), NORMAL: vertices(model.normals, "VEC3"), COLOR_0: vertices(model.colours, "VEC3"),
    TEXCOORD_0: vertices(model.facing, "VEC2"), JOINTS_0: vertices(model.bones, "VEC4"), WEIGHTS_0: vertices(model.weights, "VEC4"),
  };
  const primitives = [model.body, model.face].map((triangles, material) => ({ attributes, material, indices: asset.accessor(triangles, "SCALAR", { target: "indices" }) }));
  const painted = face ? { baseColorTexture: { index: 0 } } : {};
  Object.assign(asset.more, {
    meshes: [{ name: "figure", primitives }],
    materials: [{ name: "figure", pbrMetallicRoughness: MATERIAL }, { name: "face", pbrMetallicRoughness: { ...MATERIAL, ...painted } }],
    skins: [{ joints: Array.from({ length: bones }, (_, bone) => bone), skeleton: 0, inverseBindMatrices: asset.accessor(unbind, "MAT4") }],
    ...(face ? { textures: [{ source: 0 }], images: [{ bufferView: asset.view(face), mimeType: "image/png" }] } : {}),
  });
  asset.nodes.push({ name: "puppet", mesh: 0, skin: 0 });
  return asset.nodes.length - 1;
}
