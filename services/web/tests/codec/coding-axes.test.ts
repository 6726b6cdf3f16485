import * as fc from "fast-check";
import { expect, test } from "vitest";
import { codingAxes, multiplyMatrices } from "../../src/codec/coding-axes";
import { fromRotationVector, multiply, toMatrix } from "../../src/motion/rotation";
import { type Figure, JOINTS, PARENTS } from "../../src/motion/skeleton";
import { arbitraryFigure, arbitraryReference, REST_ROTATIONS } from "./arbitrary-skeleton";

const axesOf = (axes: Float64Array, name: string) =>
  axes.subarray(JOINTS.indexOf(name) * 9, JOINTS.indexOf(name) * 9 + 9);
const expectClose = (got: ArrayLike<number>, wanted: readonly number[], by = 9) =>
  wanted.forEach((value, i) => expect(got[i]).toBeCloseTo(value, by));

function applyMatrix(m: Float64Array, v: ArrayLike<number>): number[] {
  return [0, 3, 6].map((row) => m[row] * v[0] + m[row + 1] * v[1] + m[row + 2] * v[2]);
}

/** Without size, but for the lengths named: a joint's offset, or with " tip" its tip. */
function createFigure(named: Record<string, readonly [number, number, number]>): Figure {
  const made = { offsets: new Float64Array(54), tips: new Float64Array(54) };
  for (const [name, arm] of Object.entries(named)) {
    const joint = JOINTS.indexOf(name.replace(" tip", ""));
    (name.endsWith(" tip") ? made.tips : made.offsets).set(arm, joint * 3);
  }
  return made;
}

test("are right-handed and square to each other for any figure and any references", () => {
  fc.assert(
    fc.property(arbitraryFigure, arbitraryReference, (dancer, reference) => {
      const axes = codingAxes(dancer, reference);
      for (let joint = 0; joint < 18; joint++) {
        const m = axes.subarray(joint * 9, joint * 9 + 9);
        const transposed = Float64Array.from([0, 3, 6, 1, 4, 7, 2, 5, 8], (i) => m[i]);
        expectClose(multiplyMatrices(m, transposed), [1, 0, 0, 0, 1, 0, 0, 0, 1]);
        const [a, b, c, d, e, f, g, h, i] = m;
        expect(a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)).toBeCloseTo(1, 9);
      }
    }),
  );
});

test("have a joint's only bone along the second: up where it stands, down where it hangs", () => {
  const single = (joint: number, dancer: Figure) => {
    const children = PARENTS.flatMap((parent, child) => (parent === joint ? [child] : []));
    if (children.length > 1) return null;
    const arms = children.length === 1 ? dancer.offsets.subarray(children[0] * 3) : dancer.tips.subarray(joint * 3);
    const length = Math.hypot(arms[0], arms[1], arms[2]);
    return length > 1e-3 ? { arm: arms, length } : null;
  };
  fc.assert(
    fc.property(arbitraryFigure, arbitraryReference, (dancer, reference) => {
      const axes = codingAxes(dancer, reference);
      JOINTS.forEach((name, joint) => {
        const bone = single(joint, dancer);
        if (bone)
          expectClose(applyMatrix(axesOf(axes, name), bone.arm), [
            0,
            name === "skullbase" ? bone.length : -bone.length,
            0,
          ]);
      });
    }),
  );
});

test("of a joint with several bones or with none are the dancer's as the references have them", () => {
  fc.assert(
    fc.property(arbitraryReference, (reference) => {
      const standing = reference.slice(),
        wanted = new Float64Array(9);
      const axes = codingAxes(
        createFigure({
          sacroiliac: [0, 0.3, 0.4],
          vl5: [0, 0.4, 0],
          l_hip: [0.1, 0, 0],
          l_wrist: [0, -0.2, 0],
          "l_wrist tip": [0, -9e-4, 0],
        }),
        reference,
      );
      for (const name of ["humanoid_root", "sacroiliac", "vl5", "skullbase", "l_hip", "l_wrist"]) {
        const joint = JOINTS.indexOf(name);
        const chain = [];
        for (let j = joint; j >= 0; j = PARENTS[j]) chain.unshift(j);
        standing.set([1, 0, 0, 0], joint * 4);
        for (const j of chain) multiply(standing, joint * 4, standing, joint * 4, reference, j * 4);
        toMatrix(wanted, 0, standing, joint * 4);
        expectClose(axesOf(axes, name), [...wanted]);
      }
    }),
  );
});

test("mean the same whatever the frames of the skeleton's joints", () => {
  // each joint's own frame turned: what hangs on it and its children's rotations are told in the new one
  fc.assert(
    fc.property(arbitraryFigure, arbitraryReference, arbitraryReference, (dancer, reference, frames) => {
      const inverse = frames.map((part, i) => (i % 4 === 0 ? part : -part));
      const other = { offsets: dancer.offsets.slice(), tips: dancer.tips.slice() },
        told = reference.slice();
      const m = new Float64Array(9);
      for (let joint = 0; joint < 18; joint++) {
        toMatrix(m, 0, inverse, joint * 4);
        other.tips.set(applyMatrix(m, dancer.tips.subarray(joint * 3)), joint * 3);
        multiply(told, joint * 4, told, joint * 4, frames, joint * 4);
        if (joint === 0) continue;
        toMatrix(m, 0, inverse, PARENTS[joint] * 4);
        other.offsets.set(applyMatrix(m, dancer.offsets.subarray(joint * 3)), joint * 3);
        multiply(told, joint * 4, inverse, PARENTS[joint] * 4, told, joint * 4);
      }
      const [one, two] = [codingAxes(dancer, reference), codingAxes(other, told)];
      for (let joint = 0; joint < 18; joint++) {
        toMatrix(m, 0, frames, joint * 4);
        expectClose(
          multiplyMatrices(one.subarray(joint * 9, joint * 9 + 9), m),
          [...two.subarray(joint * 9, joint * 9 + 9)],
          6,
        );
      }
    }),
  );
});

test("a bone that is almost opposite turns over about its side", () => {
  // straight up instead of down: left stays left, and forward is back
  expectClose(
    axesOf(codingAxes(createFigure({ l_knee: [0, 0.4, 0] }), REST_ROTATIONS), "l_hip"),
    [1, 0, 0, 0, -1, 0, 0, 0, -1],
  );
  expectClose(
    axesOf(codingAxes(createFigure({ "skullbase tip": [0, -0.2, 0] }), REST_ROTATIONS), "skullbase"),
    [1, 0, 0, 0, -1, 0, 0, 0, -1],
  );
});

test("a bent joint's first axis is its hinge, to the side that it had; a straight one's is not", () => {
  const bent = (angle: number) => {
    const reference = REST_ROTATIONS.slice(),
      knee = JOINTS.indexOf("l_knee");
    fromRotationVector(reference, knee * 4, angle * 0.8, 0, angle * 0.6);
    return {
      axes: axesOf(codingAxes(createFigure({ l_knee: [0, -0.4, 0], l_ankle: [0, -0.4, 0] }), reference), "l_knee"),
      reference,
    };
  };
  for (const angle of [0.5, -0.5, 1.2, -1.2]) {
    const { axes, reference } = bent(angle);
    const standing = new Float64Array(9);
    toMatrix(standing, 0, reference, JOINTS.indexOf("l_knee") * 4);
    // the first row, back in the dancer's axes, is the axis of the bend
    expectClose(applyMatrix(standing, axes), [0.8, 0, 0.6]);
  }
  // bent by less than a sine of 0.2, the shank's axes are the straight ones carried along: the bend undone
  expectClose(bent(0.15).axes, [1, 0, 0, 0, 1, 0, 0, 0, 1]);
});
