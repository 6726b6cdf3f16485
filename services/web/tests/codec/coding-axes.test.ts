import * as fc from "fast-check";
import { expect, test } from "vitest";
import { codingAxes, multiplyMatrices } from "../../src/codec/coding-axes";
import { fromRotationVector, multiply, toMatrix } from "../../src/motion/rotation";
import { type Figure, JOINTS, PARENTS } from "../../src/motion/skeleton";
import { arbitraryFigure, arbitraryReference, REST_ROTATIONS } from "./arbitrary-skeleton";

const axesOf = (axes: Float64Array, name: string) =>
  axes.subarray(JOINTS.indexOf(name) * 9, JOINTS.indexOf(name) * 9 + 9);
const expectClose = (actual: ArrayLike<number>, expected: readonly number[], digits = 9) =>
  expected.forEach((value, i) => expect(actual[i]).toBeCloseTo(value, digits));

function applyMatrix(m: Float64Array, v: ArrayLike<number>): number[] {
  return [0, 3, 6].map((row) => m[row] * v[0] + m[row + 1] * v[1] + m[row + 2] * v[2]);
}

/** Returns a figure with only the given bones: offsets of joints, or tips if the name ends with " tip". */
function createFigure(bones: Record<string, readonly [number, number, number]>): Figure {
  const figure = { offsets: new Float64Array(54), tips: new Float64Array(54) };
  for (const [name, arm] of Object.entries(bones)) {
    const joint = JOINTS.indexOf(name.replace(" tip", ""));
    (name.endsWith(" tip") ? figure.tips : figure.offsets).set(arm, joint * 3);
  }
  return figure;
}

test("axes are right-handed and orthogonal for any figure and reference", () => {
  fc.assert(
    fc.property(arbitraryFigure, arbitraryReference, (figure, reference) => {
      const axes = codingAxes(figure, reference);
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

test("second axis points along the only bone, up or down", () => {
  const onlyBone = (joint: number, figure: Figure) => {
    const children = PARENTS.flatMap((parent, child) => (parent === joint ? [child] : []));
    if (children.length > 1) return null;
    const arms = children.length === 1 ? figure.offsets.subarray(children[0] * 3) : figure.tips.subarray(joint * 3);
    const length = Math.hypot(arms[0], arms[1], arms[2]);
    return length > 1e-3 ? { arm: arms, length } : null;
  };
  fc.assert(
    fc.property(arbitraryFigure, arbitraryReference, (figure, reference) => {
      const axes = codingAxes(figure, reference);
      JOINTS.forEach((name, joint) => {
        const bone = onlyBone(joint, figure);
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

test("joint with several bones or none has the axes of the reference pose", () => {
  fc.assert(
    fc.property(arbitraryReference, (reference) => {
      const world = reference.slice(),
        expected = new Float64Array(9);
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
        world.set([1, 0, 0, 0], joint * 4);
        for (const j of chain) multiply(world, joint * 4, world, joint * 4, reference, j * 4);
        toMatrix(expected, 0, world, joint * 4);
        expectClose(axesOf(axes, name), [...expected]);
      }
    }),
  );
});

test("axes do not depend on the frames of the joints", () => {
  // rotate the frame of each joint, and express its bones and its children's rotations in the new frame
  fc.assert(
    fc.property(arbitraryFigure, arbitraryReference, arbitraryReference, (figure, reference, frames) => {
      const inverse = frames.map((part, i) => (i % 4 === 0 ? part : -part));
      const other = { offsets: figure.offsets.slice(), tips: figure.tips.slice() },
        otherReference = reference.slice();
      const m = new Float64Array(9);
      for (let joint = 0; joint < 18; joint++) {
        toMatrix(m, 0, inverse, joint * 4);
        other.tips.set(applyMatrix(m, figure.tips.subarray(joint * 3)), joint * 3);
        multiply(otherReference, joint * 4, otherReference, joint * 4, frames, joint * 4);
        if (joint === 0) continue;
        toMatrix(m, 0, inverse, PARENTS[joint] * 4);
        other.offsets.set(applyMatrix(m, figure.offsets.subarray(joint * 3)), joint * 3);
        multiply(otherReference, joint * 4, inverse, PARENTS[joint] * 4, otherReference, joint * 4);
      }
      const [one, two] = [codingAxes(figure, reference), codingAxes(other, otherReference)];
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

test("bone opposite to its rest direction turns over sideways", () => {
  // straight up instead of down: left stays left, forward becomes backward
  expectClose(
    axesOf(codingAxes(createFigure({ l_knee: [0, 0.4, 0] }), REST_ROTATIONS), "l_hip"),
    [1, 0, 0, 0, -1, 0, 0, 0, -1],
  );
  expectClose(
    axesOf(codingAxes(createFigure({ "skullbase tip": [0, -0.2, 0] }), REST_ROTATIONS), "skullbase"),
    [1, 0, 0, 0, -1, 0, 0, 0, -1],
  );
});

test("first axis of a bent joint is its hinge, that of a straight one is not", () => {
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
    const orientation = new Float64Array(9);
    toMatrix(orientation, 0, reference, JOINTS.indexOf("l_knee") * 4);
    // the first row, in the figure's axes, is the axis of the bend
    expectClose(applyMatrix(orientation, axes), [0.8, 0, 0.6]);
  }
  // below a sine of 0.2, the shank has the axes of a straight leg, rotated with it
  expectClose(bent(0.15).axes, [1, 0, 0, 0, 1, 0, 0, 0, 1]);
});
