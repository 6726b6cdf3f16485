import * as fc from "fast-check";
import { expect, test } from "vitest";
import { createExtendedPose, extendPose, extensionKinds, extensionNames, meetBone } from "../../src/motion/extension";
import { createWorldTransforms, type Figure, worldTransforms } from "../../src/motion/skeleton";
import { extensionVectors, goldenBody } from "../golden-extensions";

const golden = extensionVectors();

test.each(golden.poses)("golden pose of track $track", (vector) => {
  const extension = goldenBody(golden.tracks[vector.track]);
  const figure: Figure = { offsets: Float64Array.from(vector.offsets), tips: new Float64Array(54) };
  const pose = { root: Float64Array.from(vector.root), rotations: Float64Array.from(vector.rotations) };
  const world = worldTransforms(figure, pose, createWorldTransforms());
  const out = extendPose(figure, world, Float64Array.from(vector.values), createExtendedPose(extension));
  for (const [made, recorded] of [
    [out.positions, vector.positions],
    [out.orientations, vector.orientations],
    [out.extraPositions, vector.extra_positions],
    [out.extraOrientations, vector.extra_orientations],
  ] as const) {
    expect(made.length).toBe(recorded.length);
    recorded.forEach((value, n) => expect(Math.abs(made[n] - value)).toBeLessThan(1e-11));
  }
});

test("names depend on the number of the spine's joints", () => {
  expect(extensionNames(extensionKinds(2, true, false))).toEqual(["vl5", "vt10", "vc4"]);
  expect(extensionNames(extensionKinds(0, false, true))).toEqual(["l_sternoclavicular", "r_sternoclavicular"]);
});

test("a bone has its length and lies on the line within reach", () => {
  const point = fc.tuple(...[0, 1, 2].map(() => fc.double({ min: -1, max: 1, noNaN: true })));
  const direction = fc.tuple(fc.double({ min: -3, max: 3, noNaN: true }), fc.double({ min: -1, max: 1, noNaN: true }));
  fc.assert(
    fc.property(
      point,
      direction,
      point,
      fc.double({ min: 0.05, max: 1, noNaN: true }),
      (line, [turn, z], own, size) => {
        const across = Math.sqrt(1 - z * z);
        const along = Float64Array.of(across * Math.cos(turn), across * Math.sin(turn), z);
        const positions = Float64Array.from([...line, ...line.map((value, i) => value + along[i])]);
        const out = Float64Array.from([...own, 0, 0, 0]);
        meetBone(positions, 0, along, out, size);
        expect(Math.hypot(out[3] - out[0], out[4] - out[1], out[5] - out[2])).toBeCloseTo(size, 9);
        const from = (x: Float64Array, at: number) => [0, 1, 2].map((i) => x[at + i] - line[i]);
        const distance = (v: number[]) => {
          const ahead = v.reduce((sum, value, i) => sum + value * along[i], 0);
          return Math.hypot(...v.map((value, i) => value - ahead * along[i]));
        };
        if (distance(from(out, 0)) < size - 1e-3) expect(distance(from(out, 3))).toBeLessThan(1e-6);
      },
    ),
  );
});
