/** Face of a GLB file: the puppet's head as a mesh with morph targets, and the channel of their weights. */

import { expressionIndex, faceExpressionNames } from "../motion/face";
import type { GltfBuilder } from "./gltf";
import { faceWeightsAt, type SampledMotion } from "./sampled-motion";

/** The puppet's head at rest, as a mesh of its own. */
export interface PuppetHead {
  /** Per vertex: position (metres), normal, and position on the face texture, from its upper left corner. */
  positions: Float32Array<ArrayBuffer>;
  normals: Float32Array<ArrayBuffer>;
  faceUvs: Float32Array<ArrayBuffer>;
  /** Linear RGB of all vertices. */
  colour: readonly number[];
  /** Triangles with the face texture, and all others. */
  face: Uint32Array<ArrayBuffer>;
  back: Uint32Array<ArrayBuffer>;
  /** Return the displacements [vertex][3] of an expression at the weight 1, in metres. */
  displacements(expression: string): Float32Array<ArrayBuffer>;
}

/** Materials of the triangles without and with the face texture. */
const MATERIALS = { back: 0, face: 1 } as const;

/** Return the names of the morph targets that a motion needs, in order. */
export function targetNames({ face }: SampledMotion): string[] {
  return face ? faceExpressionNames(face.face) : [];
}

/** Return the mesh of a head that moves with bone `joint` of its skin, with morph targets of these names. */
export function createHeadMesh(asset: GltfBuilder, head: PuppetHead, joint: number, names: readonly string[]): object {
  const count = head.positions.length / 3;
  const vertices = { target: "vertices" } as const;
  const repeat = (values: readonly number[]) => Array.from({ length: count }, () => values).flat();
  const attributes = {
    POSITION: asset.addAccessor(head.positions, "VEC3", { ...vertices, bounded: true }),
    NORMAL: asset.addAccessor(head.normals, "VEC3", vertices),
    COLOR_0: asset.addAccessor(Float32Array.from(repeat(head.colour)), "VEC3", vertices),
    TEXCOORD_0: asset.addAccessor(head.faceUvs, "VEC2", vertices),
    JOINTS_0: asset.addAccessor(Uint8Array.from(repeat([joint, 0, 0, 0])), "VEC4", vertices),
    WEIGHTS_0: asset.addAccessor(Float32Array.from(repeat([1, 0, 0, 0])), "VEC4", vertices),
  };
  // All primitives of a mesh have the same targets (glTF 2.0, 3.7.2.2).
  const targets = names.map((name) => ({ POSITION: asset.addSparseAccessor(head.displacements(name)) }));
  const primitives = (["back", "face"] as const).map((part) => ({
    attributes,
    material: MATERIALS[part],
    indices: asset.addAccessor(head[part], "SCALAR", { target: "indices" }),
    targets,
  }));
  return { name: "head", primitives, weights: names.map(() => 0), extras: { targetNames: names } };
}

/** Animate the morph targets of a node's mesh; the gaze is in radians. `times` is the accessor of the frames' times. */
export function addFaceChannel(asset: GltfBuilder, node: number, motion: SampledMotion, times: number): void {
  const indices = targetNames(motion).map(expressionIndex);
  const weights = new Float32Array(motion.frames * indices.length);
  for (let frame = 0; frame < motion.frames; frame++) {
    const values = faceWeightsAt(motion, frame) as Float64Array;
    indices.forEach((index, target) => (weights[frame * indices.length + target] = values[index]));
  }
  asset.addChannel(node, "weights", times, weights);
}
