/**
 * Weights of the channels: how far a small rotation of each joint moves the body (`proto/codec.md`, 2.5). A
 * channel's values are multiplied with its weight before they are quantised. Weights depend on the skeleton description
 * alone.
 */

import { CHANNEL_COUNT, type Figure, JOINT_COUNT, JOINTS, PARENTS, TIP_JOINTS } from "../motion/skeleton";
import { codingAxes, multiplyMatrices } from "./coding-axes";

const LEVER_EXPONENT = 0.45;
const TWIST_INERTIA_M2 = 0.06 ** 2;

/** Precision of the channels (19) relative to what the lever arms give. */
const CHANNEL_PRECISION = new Float64Array(CHANNEL_COUNT).fill(1);
CHANNEL_PRECISION.set([1.15, 0.88, 0.88]);
for (const name of ["l_midtarsal", "r_midtarsal"]) CHANNEL_PRECISION[JOINTS.indexOf(name) + 1] = 0.87;
for (const name of ["skullbase", "l_wrist", "r_wrist"]) CHANNEL_PRECISION[JOINTS.indexOf(name) + 1] = 0.9;

/** Weight of each channel and its inverse: matrices [channel 19][3][3]. */
export interface ChannelWeights {
  readonly weights: Float64Array;
  readonly inverseWeights: Float64Array;
}

/** Returns the channel weights of a figure whose rotations are relative to `reference` (72). */
export function channelWeights(figure: Figure, reference: Float64Array): ChannelWeights {
  const squares = Array.from({ length: JOINT_COUNT }, () =>
    Float64Array.of(TWIST_INERTIA_M2, 0, 0, 0, TWIST_INERTIA_M2, 0, 0, 0, TWIST_INERTIA_M2),
  );
  const points = Array.from({ length: JOINT_COUNT }, (_, joint) => (TIP_JOINTS.includes(joint) ? 2 : 1));
  for (let joint = JOINT_COUNT - 1; joint >= 0; joint--) {
    if (TIP_JOINTS.includes(joint)) addLever(squares[joint], figure.tips, joint, 1);
    if (joint > 0) {
      const parent = PARENTS[joint];
      addLever(squares[parent], figure.offsets, joint, points[joint]);
      points[parent] += points[joint];
    }
  }
  const weights = new Float64Array(CHANNEL_COUNT * 9),
    inverses = new Float64Array(CHANNEL_COUNT * 9);
  for (let axis = 0; axis < 3; axis++) {
    const weight = points[0] ** (LEVER_EXPONENT / 2) * CHANNEL_PRECISION[0];
    weights[axis * 4] = weight;
    inverses[axis * 4] = 1 / weight;
  }
  const axes = codingAxes(figure, reference);
  squares.forEach((square, joint) => {
    const precision = CHANNEL_PRECISION[joint + 1];
    const { values, vectors } = eigenDecomposition(square);
    const symmetric = (power: number) =>
      composeFromEigen(
        vectors,
        values.map((value) => (Math.sqrt(value) * precision) ** power),
      );
    const own = axes.subarray(joint * 9, joint * 9 + 9);
    weights.set(multiplyMatrices(own, symmetric(1)), (joint + 1) * 9);
    // the inverse of a rotation is its transpose
    inverses.set(multiplyMatrices(symmetric(-1), transpose(own)), (joint + 1) * 9);
  });
  return { weights, inverseWeights: inverses };
}

/** Returns the symmetric matrix with these eigenvectors (columns) and eigenvalues. */
function composeFromEigen(vectors: Float64Array, values: Float64Array): Float64Array {
  return multiplyMatrices(
    vectors.map((part, i) => part * values[i % 3]),
    transpose(vectors),
  );
}

function transpose(m: Float64Array): Float64Array {
  return Float64Array.of(m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8]);
}

/** Adds count^0.45 (|a|^2 I - a a^T) of the arm a of a joint to `square`. */
function addLever(square: Float64Array, arms: Float64Array, joint: number, count: number): void {
  const arm = arms.subarray(joint * 3, joint * 3 + 3);
  const length = arm[0] ** 2 + arm[1] ** 2 + arm[2] ** 2;
  for (let i = 0; i < 9; i++) {
    square[i] += count ** LEVER_EXPONENT * ((i % 4 === 0 ? length : 0) - arm[Math.floor(i / 3)] * arm[i % 3]);
  }
}

/**
 * Returns the eigenvalues (3) and eigenvectors (columns of [3][3]) of a symmetric matrix [3][3], by Jacobi rotations
 * (Golub and Van Loan, Matrix Computations, 8.5).
 */
function eigenDecomposition(symmetric: Float64Array): { values: Float64Array; vectors: Float64Array } {
  const a = symmetric.slice(),
    vectors = Float64Array.of(1, 0, 0, 0, 1, 0, 0, 0, 1);
  // a sweep squares the off-diagonal elements: six reach the precision of doubles
  for (let sweep = 0; sweep < 12; sweep++) {
    for (const [p, q] of [
      [0, 1],
      [0, 2],
      [1, 2],
    ]) {
      if (a[p * 3 + q] === 0) continue;
      const tau = (a[q * 4] - a[p * 4]) / (2 * a[p * 3 + q]);
      const tangent = (tau < 0 ? -1 : 1) / (Math.abs(tau) + Math.sqrt(1 + tau * tau));
      const cosine = 1 / Math.sqrt(1 + tangent * tangent),
        sine = tangent * cosine;
      applyGivensRotation(a, p, q, 3, 1, cosine, sine);
      applyGivensRotation(a, p, q, 1, 3, cosine, sine);
      applyGivensRotation(vectors, p, q, 1, 3, cosine, sine);
    }
  }
  return { values: Float64Array.of(a[0], a[4], a[8]), vectors };
}

/** Rotates rows `p` and `q` of a matrix (`stride` 3, `step` 1) or its columns (`stride` 1, `step` 3). */
function applyGivensRotation(
  m: Float64Array,
  p: number,
  q: number,
  stride: number,
  step: number,
  cosine: number,
  sine: number,
): void {
  for (let i = 0; i < 3; i++) {
    const x = m[p * stride + i * step],
      y = m[q * stride + i * step];
    m[p * stride + i * step] = cosine * x - sine * y;
    m[q * stride + i * step] = sine * x + cosine * y;
  }
}
