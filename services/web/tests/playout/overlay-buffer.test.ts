import * as fc from "fast-check";
import { describe, expect, test } from "vitest";
import { restPose } from "../../src/motion/skeleton";
import { OVERLAY_HOLD_US, OverlayBuffer } from "../../src/playout/overlay-buffer";
import type { Overlay } from "../../src/wire/overlay";

const QUARTER = Math.round(32767 / 4);

/** Return an overlay that turns the first joint of each of `limbs` about x by `units`. */
function overlay(due: number, units: number, ...limbs: number[]): Overlay {
  const numbers = () => Int16Array.of(units, 0, 0, 0, 0, 0, 0, 0, 0);
  return { name: "Overlay", sequence: 0, due, limbs: new Map(limbs.map((limb) => [limb, numbers()])), earlier: [] };
}

/** Return the angle about x of `joint` at `clock`. */
function angle(overlays: OverlayBuffer, clock: number, joint = 12): number {
  const pose = restPose();
  overlays.apply(clock, pose);
  return 2 * Math.atan2(pose.rotations[joint * 4 + 1], pose.rotations[joint * 4]);
}

describe("controlled limb", () => {
  test("is interpolated between overlays", () => {
    const overlays = new OverlayBuffer();
    overlays.put(overlay(1_000_000, 0, 0));
    overlays.put(overlay(1_100_000, QUARTER, 0));
    expect(angle(overlays, 1_000_000)).toBeCloseTo(0, 9);
    expect(angle(overlays, 1_025_000)).toBeCloseTo(Math.PI / 16, 3);
    expect(angle(overlays, 1_100_000)).toBeCloseTo(Math.PI / 4, 3);
  });

  test("is blended in from the motion if it is new in an overlay", () => {
    const overlays = new OverlayBuffer();
    overlays.put(overlay(1_000_000, QUARTER, 1));
    overlays.put(overlay(1_100_000, QUARTER, 0, 1));
    expect(angle(overlays, 1_050_000)).toBeCloseTo(Math.PI / 8, 3);
    expect(angle(overlays, 1_050_000, 15)).toBeCloseTo(Math.PI / 4, 3);
  });

  test("returns to the motion after an empty overlay or the hold time", () => {
    const overlays = new OverlayBuffer();
    overlays.put(overlay(1_000_000, QUARTER, 0));
    expect(overlays.apply(1_000_000 + OVERLAY_HOLD_US - 1, restPose())).toBe(1);
    expect(overlays.apply(1_000_000 + OVERLAY_HOLD_US, restPose())).toBe(0);
    overlays.put(overlay(1_050_000, 0));
    expect(overlays.apply(1_050_000, restPose())).toBe(0);
  });

  test("is not replaced before the first overlay is due", () => {
    const overlays = new OverlayBuffer();
    overlays.put(overlay(1_000_000, QUARTER, 0));
    overlays.put(overlay(1_000_000 + 2 * OVERLAY_HOLD_US, QUARTER, 0));
    expect(overlays.apply(999_999, restPose())).toBe(0);
    expect(overlays.apply(1_000_000 + 2 * OVERLAY_HOLD_US - 1, restPose())).toBe(0);
    expect(overlays.apply(1_000_000 + 2 * OVERLAY_HOLD_US, restPose())).toBe(1);
  });
});

test("late and duplicate overlays are inserted by due time", () => {
  const overlays = new OverlayBuffer();
  overlays.put(overlay(1_200_000, 0, 0));
  overlays.put(overlay(1_000_000, 0, 0));
  overlays.put(overlay(1_100_000, 0, 0));
  overlays.put(overlay(1_100_000, QUARTER, 0));
  expect(angle(overlays, 1_100_000)).toBeCloseTo(Math.PI / 4, 3);
  expect(angle(overlays, 1_150_000)).toBeCloseTo(Math.PI / 8, 3);
});

test("frames of an overlay apply at their own times", () => {
  const overlays = new OverlayBuffer();
  const [first, second, third] = [0, 4_000, 10_000].map((units) => overlay(0, units, 0).limbs);
  overlays.put({ name: "Overlay", sequence: 0, due: 1_033_334, limbs: third, earlier: [first, second] });
  const unit = Math.PI / 32767;
  expect(overlays.apply(999_999, restPose())).toBe(0);
  [
    [1_000_000, 0],
    [1_008_333.5, 2_000],
    [1_016_667, 4_000],
    [1_025_000.5, 7_000],
    [1_033_334, 10_000],
  ].forEach(([clock, units]) => expect(angle(overlays, clock)).toBeCloseTo(units * unit, 9));
});

test("only controlled limbs change, and rotations have unit length", () => {
  const number = fc.integer({ min: -32767, max: 32767 });
  const limbs = fc.uniqueArray(fc.nat(3));
  const one = fc.tuple(fc.integer({ min: 0, max: 600_000 }), limbs, fc.array(number, { minLength: 9, maxLength: 9 }));
  fc.assert(
    fc.property(fc.array(one, { maxLength: 12 }), fc.integer({ min: 0, max: 700_000 }), (all, clock) => {
      const overlays = new OverlayBuffer();
      for (const [due, which, numbers] of all) {
        const held = new Map(which.map((limb) => [limb, Int16Array.from(numbers)]));
        overlays.put({ name: "Overlay", sequence: 0, due, limbs: held, earlier: [] });
      }
      const pose = restPose(),
        rest = restPose();
      const mask = overlays.apply(clock, pose);
      for (let joint = 0; joint < 18; joint++) {
        const limb = [12, 15, 2, 6].findIndex((first) => joint >= first && joint < first + 3);
        const turned = pose.rotations.subarray(joint * 4, joint * 4 + 4);
        expect(Math.hypot(...turned)).toBeCloseTo(1, 9);
        if (limb < 0 || !((mask >> limb) & 1))
          expect(turned).toEqual(rest.rotations.subarray(joint * 4, joint * 4 + 4));
      }
    }),
  );
});

describe("several performers", () => {
  test("overlay changes only the performer of the limb", () => {
    const overlays = new OverlayBuffer();
    overlays.put(overlay(1_000_000, QUARTER, 5, 14));
    overlays.put(overlay(1_100_000, QUARTER, 5, 14));
    const poses = [0, 1, 2, 3].map(() => restPose());
    expect(poses.map((pose, performer) => overlays.apply(1_050_000, pose, performer))).toEqual([0, 0b0010, 0, 0b0100]);
    const joints = poses.map(({ rotations }) =>
      [...rotations.keys()].filter((at) => rotations[at] !== restPose().rotations[at]).map((at) => Math.floor(at / 4)),
    );
    // right shoulder of the second performer, left hip of the fourth
    expect(joints.map((changed) => [...new Set(changed)])).toEqual([[], [15], [], [2]]);
    for (const [performer, joint] of [
      [1, 15],
      [3, 2],
    ]) {
      const [w, x] = poses[performer].rotations.subarray(joint * 4);
      expect(2 * Math.atan2(x, w)).toBeCloseTo(Math.PI / 4, 3);
    }
  });

  test("limb is blended in while another performer's is held", () => {
    const overlays = new OverlayBuffer();
    overlays.put(overlay(1_000_000, QUARTER, 0));
    overlays.put(overlay(1_100_000, QUARTER, 0, 4));
    const pose = restPose();
    expect(overlays.apply(1_050_000, pose, 1)).toBe(1);
    expect(2 * Math.atan2(pose.rotations[49], pose.rotations[48])).toBeCloseTo(Math.PI / 8, 3);
    expect(angle(overlays, 1_050_000)).toBeCloseTo(Math.PI / 4, 3);
    // not in the next overlay: it returns to the motion at once
    overlays.put(overlay(1_150_000, QUARTER, 0));
    expect(overlays.apply(1_120_000, restPose(), 1)).toBe(0);
  });
});

test("clear removes all overlays", () => {
  const overlays = new OverlayBuffer();
  overlays.put(overlay(1_000_000, QUARTER, 0));
  overlays.clear();
  expect(overlays.apply(1_000_000, restPose())).toBe(0);
});
