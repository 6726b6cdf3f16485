import { beforeEach, expect, test } from "vitest";
import type { StagedPose } from "../../../src/motion/extension";
import { CHAIN_COUNT, type Hands, MAX_CHAIN_JOINTS, poseHands, WRISTS } from "../../../src/motion/hands";
import { PROP_FORMS, PROP_KINDS, type PropKind } from "../../../src/motion/props";
import { JOINT_COUNT } from "../../../src/motion/skeleton";
import { type FormedProp, PropGrip } from "../../../src/stage/props/prop-grip";

const [LEFT_INDEX, RIGHT_INDEX] = [1, 6];
const held = (limb: number | null, kind: PropKind = "fan"): FormedProp => ({
  prop: 0,
  kind,
  limb,
  place: [0, 0, 0],
  form: PROP_FORMS[kind],
});
const pose: StagedPose = { root: Float64Array.of(0, 1, 0), rotations: new Float64Array(JOINT_COUNT * 4) };
/** Hands of a motion that has the first two joints of the left index finger. */
const motionHands: Hands = {
  counts: Array.from({ length: CHAIN_COUNT }, (_, chain) => (chain === LEFT_INDEX ? 2 : 0)),
  bases: new Float64Array(CHAIN_COUNT * 3),
  lengths: new Float64Array(CHAIN_COUNT * MAX_CHAIN_JOINTS).fill(0.03),
};

let grip: PropGrip;

beforeEach(() => {
  grip = new PropGrip();
});

/** Return the bend of a chain's joint in a pose, in radians; null if its joints are not known. */
function bend({ hands }: StagedPose, chain: number, place: number): number | null {
  const count = hands?.hands.counts[chain] ?? 0;
  if (!hands || place >= count) return null;
  const start = hands.hands.counts.slice(0, chain).reduce((sum, one) => sum + one, 0);
  return Math.hypot(...hands.values.subarray((start + place) * 3, (start + place) * 3 + 3));
}

test("nothing changes without props, or in hands of others", () => {
  for (const props of [[], [held(null)], [held(4)]]) {
    grip.update(props, 0, Infinity);
    expect(grip.apply(pose)).toBe(pose);
  }
});

test.each(PROP_KINDS)("a hand closes around a %s and opens again, without a jump", (kind) => {
  const bends: number[] = [];
  const run = (frames: number, props: readonly FormedProp[]) => {
    for (let frame = 0; frame < frames; frame++) {
      grip.update(props, 0, 1 / 60);
      bends.push(bend(grip.apply(pose), LEFT_INDEX, 1) ?? 0);
    }
  };
  run(30, [held(0, kind)]);
  expect(bends[29]).toBeGreaterThan(0.25);
  expect(bend(grip.apply(pose), RIGHT_INDEX, 0)).toBeNull();
  run(30, []);
  expect(grip.apply(pose)).toBe(pose);
  // The first step is from the bend at rest, which the models have.
  expect(Math.max(...bends.slice(1).map((value, at) => Math.abs(value - bends[at])))).toBeLessThan(0.15);
});

test("fingers bend towards the palms, whose sides face each other", () => {
  grip.update([held(0), { ...held(1), prop: 1 }], 0, Infinity);
  const { hands } = grip.apply({ ...pose, hands: { hands: motionHands, values: new Float64Array(6) } });
  if (!hands) throw new Error("no fingers");
  const joints = hands.hands.counts.reduce((sum, count) => sum + count, 0);
  const [positions, orientations] = [new Float64Array(JOINT_COUNT * 3), new Float64Array(JOINT_COUNT * 4)];
  for (let joint = 0; joint < JOINT_COUNT; joint++) orientations[joint * 4] = 1;
  for (const wrist of WRISTS) positions[wrist * 3 + 1] = 1;
  const out = { positions: new Float64Array(joints * 3), orientations: new Float64Array(joints * 4) };
  poseHands(hands, { positions, orientations }, out);
  const x = (chain: number) => out.positions[(chain * MAX_CHAIN_JOINTS + 2) * 3];
  // x points to the left of the performer.
  expect(x(LEFT_INDEX)).toBeLessThan(-0.02);
  expect(x(RIGHT_INDEX)).toBeGreaterThan(0.02);
});

test("the motion's fingers move on in the other hand and come back", () => {
  const values = Float64Array.from([0.1, 0.2, 0.3, 0.4, 0.5, 0.6]);
  const moved: StagedPose = { ...pose, hands: { hands: motionHands, values } };
  grip.update([held(1)], 0, Infinity);
  const closed = grip.apply(moved);
  expect(bend(closed, LEFT_INDEX, 1)).toBeCloseTo(Math.hypot(0.4, 0.5, 0.6), 12);
  expect(bend(closed, LEFT_INDEX, 2)).toBeNull();
  // Models plan their bones for these joints once.
  grip.update([held(1)], 0, 1 / 60);
  expect(grip.apply(moved).hands?.hands).toBe(closed.hands?.hands);
  grip.update([], 0, Infinity);
  expect(grip.apply(moved)).toBe(moved);
});

test("fingers lie around what is in the palm, and close around a shaft", () => {
  const [inPalm, shaft] = [0.01, 0].map((palmOffset) => {
    const form = { rest: { pitch: 0, height: 0 }, palmOffset };
    grip.update([{ ...held(0), kind: "abcdefghijklmnopq234", form }], 0, Infinity);
    return bend(grip.apply(pose), LEFT_INDEX, 1) ?? 0;
  });
  expect(inPalm).toBeCloseTo(0.3, 6);
  expect(shaft).toBeGreaterThan(1);
});
