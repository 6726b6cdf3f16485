import * as fc from "fast-check";
import { describe, expect, test } from "vitest";
import { LimbTarget, THIGH_RANGE } from "../../src/client/limb-target";

function expectNear(actual: Float64Array, expected: number[]): void {
  expected.forEach((value, axis) => expect(actual[axis]).toBeCloseTo(value, 12));
}

test("claimed limb holds its start position unless an input came first", () => {
  const target = new LimbTarget(0);
  target.claim(0);
  target.setStart(Float64Array.of(0.1, -0.8, 0.2), 10);
  target.setStart(Float64Array.of(0.5, 0, 0), 20);
  expectNear(target.valueAt(1_000), [0.1, -0.8, 0.2]);
  const moved = new LimbTarget(0);
  moved.claim(0);
  moved.setTarget(0.3, 0, 0, 5);
  moved.setStart(Float64Array.of(0.5, 0, 0), 10);
  expectNear(moved.valueAt(1_000), [0.3, 0, 0]);
});

test("second claim starts without a value", () => {
  const target = new LimbTarget(0);
  target.claim(0);
  target.setTarget(0.3, 0, 0, 5);
  target.release();
  target.claim(100);
  expect(target.isKnown).toBe(false);
  target.setStart(Float64Array.of(0, -0.5, 0), 110);
  expectNear(target.valueAt(120), [0, -0.5, 0]);
});

test("limb type is the same for every performer", () => {
  const hand = new LimbTarget(5),
    leg = new LimbTarget(6);
  for (const target of [hand, leg]) {
    target.claim(0);
    target.setTarget(3, 4, 0, 0);
  }
  expectNear(hand.valueAt(1_000), [0.6, 0.8, 0]);
  expectNear(leg.valueAt(1_000), [THIGH_RANGE[1], 0, 0]);
});

describe("target", () => {
  test("is approached linearly in the time between the last two inputs", () => {
    const target = new LimbTarget(0);
    target.claim(0);
    target.setTarget(0, 0, 0, 0);
    target.setTarget(0.4, -0.2, 0, 20);
    expectNear(target.valueAt(20), [0, 0, 0]);
    expectNear(target.valueAt(25), [0.1, -0.05, 0]);
    expectNear(target.valueAt(40), [0.4, -0.2, 0]);
    expectNear(target.valueAt(4_000), [0.4, -0.2, 0]);
    // the session receives the target itself
    target.setTarget(0.8, 0, 0, 4_020);
    expectNear(target.value, [0.8, 0, 0]);
    expectNear(target.valueAt(4_053), [0.8, 0, 0]);
  });

  test("during an approach starts from the current value", () => {
    const target = new LimbTarget(0);
    target.claim(0);
    target.setTarget(0, 0, 0, 0);
    target.setTarget(0.4, 0, 0, 20);
    target.setTarget(0, 0, 0.4, 30);
    expectNear(target.valueAt(30), [0.2, 0, 0]);
    expectNear(target.valueAt(35), [0.1, 0, 0.2]);
  });

  test("is clamped to the arm's reach, keeping its direction", () => {
    const target = new LimbTarget(0);
    target.setTarget(3, 0, 4, 0);
    expect([...target.value]).toEqual([0.6000000000000001, 0, 0.8]);
  });

  test("never jumps, whatever the inputs", () => {
    const input = fc.tuple(fc.integer({ min: 1, max: 60 }), fc.float({ min: -1, max: 1, noNaN: true }), fc.boolean());
    fc.assert(
      fc.property(fc.array(input, { minLength: 1, maxLength: 20 }), (inputs) => {
        const target = new LimbTarget(3);
        target.claim(0);
        target.setStart(Float64Array.of(0.2, 0, 0), 0);
        let now = 0,
          before = target.valueAt(0)[0];
        for (const [after, value, moves] of inputs) {
          now += after;
          before = target.valueAt(now)[0];
          if (moves) target.setVelocity(value, 0, 0, now);
          else target.setTarget(value, 0, 0, now);
          expect(target.valueAt(now)[0]).toBeCloseTo(before, 12);
        }
      }),
    );
  });
});

describe("velocity", () => {
  test("of a hand is one arm length per second along each axis", () => {
    const target = new LimbTarget(1);
    target.claim(0);
    target.setTarget(0, 0, 0, 0);
    target.setVelocity(1, -0.5, 2, 0);
    expectNear(target.valueAt(400), [0.4, -0.2, 0.4]);
    target.setVelocity(0, 0, 0, 400);
    expectNear(target.valueAt(5_000), [0.4, -0.2, 0.4]);
  });

  test("of a leg is 2 rad/s within its limits, along the first axis only", () => {
    const target = new LimbTarget(3);
    target.claim(0);
    target.setTarget(0, 9, 9, 0);
    target.setVelocity(1, 1, 1, 0);
    expect([...target.valueAt(500)]).toEqual([1, 0, 0]);
    expect(target.valueAt(60_000)[0]).toBeCloseTo((2 * Math.PI) / 3, 12);
    target.setVelocity(-1, 0, 0, 60_000);
    expect(target.valueAt(120_000)[0]).toBeCloseTo(-Math.PI / 4, 12);
  });

  test("applies once the start position is known", () => {
    const target = new LimbTarget(0);
    target.claim(0);
    target.setVelocity(1, 0, 0, 0);
    target.setStart(new Float64Array(3), 100);
    expectNear(target.valueAt(200), [0.1, 0, 0]);
  });
});

test("target of a bonded hand follows the pair once there was no input for a second", () => {
  const target = new LimbTarget(0);
  const place = Float64Array.of(0.2, 0.3, 0.4);
  target.claim(0);
  target.setTarget(0.5, 0, 0, 0);
  target.follow(place, 900);
  expectNear(target.valueAt(900), [0.5, 0, 0]);
  target.follow(place, 1_100);
  expectNear(target.valueAt(1_100), [0.2, 0.3, 0.4]);
  expect(target.hasFollowed).toBe(true);
  // a movement goes on from there, and is not interrupted
  target.setVelocity(1, 0, 0, 1_200);
  expectNear(target.valueAt(1_300), [0.3, 0.3, 0.4]);
  target.follow(place, 3_000);
  expectNear(target.valueAt(1_400), [0.4, 0.3, 0.4]);
});

test("age of an input starts with the claim and is zero while the limb moves", () => {
  const target = new LimbTarget(0);
  target.claim(100);
  expect(target.inputAgeS(350)).toBe(0.25);
  target.setTarget(0.3, 0, 0, 400);
  expect(target.inputAgeS(900)).toBe(0.5);
  target.setVelocity(1, 0, 0, 1_000);
  expect(target.inputAgeS(5_000)).toBe(0);
  target.setVelocity(0, 0, 0, 5_000);
  expect(target.inputAgeS(6_000)).toBe(1);
});
