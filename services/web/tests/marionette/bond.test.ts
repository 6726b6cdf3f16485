import { describe, expect, test } from "vitest";
import { Bond, type BondedHand, isInReach, recencyShare } from "../../src/marionette/bond";
import { type Pair, type Shoulder, toPlace, toWorld } from "../../src/marionette/carrier";
import { HAND_ACCELERATION } from "../../src/marionette/constants";
import { distanceOf, lengthOf, type Point, subtract } from "../../src/marionette/point";
import { loadVectors } from "../golden-vectors";
import { type BondCase, playBond, shoulderAt } from "./bond-cases";

const vector = loadVectors<{
  seconds: number;
  shares: [number | null, number | null, number][];
  cases: BondCase[];
}>("bonds");

describe("a bond of two hands", () => {
  test.each(vector.cases.map((each, nth) => [nth, each] as const))("case %i equals the golden vectors", (_, each) => {
    let compared = 0;
    playBond(each, vector.seconds, (frame, bond) => {
      if (frame % each.every !== 0) return;
      const [share, ...positions] = each.frames[compared++];
      expect(Math.abs(bond.share - share), `frame ${frame}`).toBeLessThan(1e-9);
      for (const side of [0, 1])
        expect(distanceOf(bond.positions[side], positions[side]), `frame ${frame}`).toBeLessThan(1e-9);
    });
    expect(compared).toBe(each.frames.length);
  });

  test.each(vector.cases.map((each, nth) => [nth, each] as const))("the hands of case %i meet and stay", (_, each) => {
    let joined = 0;
    playBond(each, vector.seconds, (frame, bond, shoulders) => {
      if (frame > 45) expect(bond.isJoined).toBe(true);
      if (!bond.isJoined) return;
      joined++;
      expect(distanceOf(...bond.positions)).toBe(0);
      for (const side of [0, 1] as const)
        expect(distanceOf(bond.positions[side], shoulders[side].position)).toBeLessThan(shoulders[side].armLengthM);
    });
    expect(joined).toBeGreaterThan(30);
  });
});

test("the share of a goal halves with the half-life of its age", () => {
  for (const [first, second, share] of vector.shares)
    expect(recencyShare(first ?? Infinity, second ?? Infinity)).toBeCloseTo(share, 12);
});

test("a pair between two still shoulders never exceeds the acceleration", () => {
  const rotation = Float64Array.of(1, 0, 0, 0);
  const shoulders = [
    { position: [0, 1.4, 0], rotation, armLengthM: 0.65, minTipDistance: 0.12 },
    { position: [0.8, 1.4, 0], rotation, armLengthM: 0.65, minTipDistance: 0.12 },
  ] as const;
  const goals: Point[] = [
    [0.7, 0.5, 0.3],
    [0.5, -2, 0.4],
    [0.6, 0.1, -0.7],
  ];
  const hands = (goal: Point): Pair<BondedHand> => [
    { shoulder: shoulders[0], goal },
    { shoulder: shoulders[1], goal: null },
  ];
  const start = toWorld(shoulders[0], [0.6, 0, 0.2]);
  const still = (shoulder: Shoulder) => ({ place: toPlace(shoulder, start), velocity: [0, 0, 0] as const });
  const bond = new Bond(hands(goals[0]), [still(shoulders[0]), still(shoulders[1])], 1);
  const shown: Point[] = [bond.positions[0]];
  for (let frame = 0; frame < 180; frame++) {
    bond.step(hands(goals[Math.floor(frame / 60)]), 1, 1 / 60);
    shown.push(bond.positions[0]);
  }
  for (let i = 2; i < shown.length; i++) {
    const change = subtract(subtract(shown[i], shown[i - 1]), subtract(shown[i - 1], shown[i - 2]));
    expect((lengthOf(change) * 3600) / 0.65).toBeLessThan(HAND_ACCELERATION + 0.5);
  }
});

test("shoulders further apart than two arms are out of reach", () => {
  const [path] = vector.cases[0].shoulders;
  const shoulder = shoulderAt(path, 0);
  const [x, y, z] = shoulder.position;
  expect(isInReach(shoulder, { ...shoulder, position: [x + 1.2, y, z] })).toBe(true);
  expect(isInReach(shoulder, { ...shoulder, position: [x + 1.3, y, z] })).toBe(false);
});
