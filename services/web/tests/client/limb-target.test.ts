import * as fc from "fast-check";
import { describe, expect, test } from "vitest";
import { LimbTarget, THIGH_RANGE } from "../../src/client/limb-target";

function near(got: Float64Array, wanted: number[]): void {
  wanted.forEach((value, axis) => expect(got[axis]).toBeCloseTo(value, 12));
}

test("taken, it stays where it was when it was taken, unless an input came before", () => {
  const pull = new LimbTarget(0);
  pull.take(0);
  pull.setStart(Float64Array.of(0.1, -0.8, 0.2), 10);
  pull.setStart(Float64Array.of(0.5, 0, 0), 20);
  near(pull.valueAt(1_000), [0.1, -0.8, 0.2]);
  const told = new LimbTarget(0);
  told.take(0);
  told.setTarget(0.3, 0, 0, 5);
  told.setStart(Float64Array.of(0.5, 0, 0), 10);
  near(told.valueAt(1_000), [0.3, 0, 0]);
});

test("taken anew it starts anew", () => {
  const pull = new LimbTarget(0);
  pull.take(0);
  pull.setTarget(0.3, 0, 0, 5);
  pull.release();
  pull.take(100);
  expect(pull.isKnown).toBe(false);
  pull.setStart(Float64Array.of(0, -0.5, 0), 110);
  near(pull.valueAt(120), [0, -0.5, 0]);
});

test("of another performer a hand is a hand and a leg is a leg", () => {
  const hand = new LimbTarget(5),
    leg = new LimbTarget(6);
  for (const pull of [hand, leg]) {
    pull.take(0);
    pull.setTarget(3, 4, 0, 0);
  }
  near(hand.valueAt(1_000), [0.6, 0.8, 0]);
  near(leg.valueAt(1_000), [THIGH_RANGE[1], 0, 0]);
});

describe("a target", () => {
  test("is gone to evenly, in the time between the last two inputs", () => {
    const pull = new LimbTarget(0);
    pull.take(0);
    pull.setTarget(0, 0, 0, 0);
    pull.setTarget(0.4, -0.2, 0, 20);
    near(pull.valueAt(20), [0, 0, 0]);
    near(pull.valueAt(25), [0.1, -0.05, 0]);
    near(pull.valueAt(40), [0.4, -0.2, 0]);
    near(pull.valueAt(4_000), [0.4, -0.2, 0]);
    // what the session is told is the target itself
    pull.setTarget(0.8, 0, 0, 4_020);
    near(pull.value, [0.8, 0, 0]);
    near(pull.valueAt(4_053), [0.8, 0, 0]);
  });

  test("that comes on the way to another starts from there", () => {
    const pull = new LimbTarget(0);
    pull.take(0);
    pull.setTarget(0, 0, 0, 0);
    pull.setTarget(0.4, 0, 0, 20);
    pull.setTarget(0, 0, 0.4, 30);
    near(pull.valueAt(30), [0.2, 0, 0]);
    near(pull.valueAt(35), [0.1, 0, 0.2]);
  });

  test("is no farther than the arm is long, keeping the direction", () => {
    const pull = new LimbTarget(0);
    pull.setTarget(3, 0, 4, 0);
    expect([...pull.value]).toEqual([0.6000000000000001, 0, 0.8]);
  });

  test("is gone to without a jump however inputs come", () => {
    const input = fc.tuple(fc.integer({ min: 1, max: 60 }), fc.float({ min: -1, max: 1, noNaN: true }), fc.boolean());
    fc.assert(
      fc.property(fc.array(input, { minLength: 1, maxLength: 20 }), (inputs) => {
        const pull = new LimbTarget(3);
        pull.take(0);
        pull.setStart(Float64Array.of(0.2, 0, 0), 0);
        let now = 0,
          before = pull.valueAt(0)[0];
        for (const [after, value, moves] of inputs) {
          now += after;
          before = pull.valueAt(now)[0];
          if (moves) pull.setVelocity(value, 0, 0, now);
          else pull.setTarget(value, 0, 0, now);
          expect(pull.valueAt(now)[0]).toBeCloseTo(before, 12);
        }
      }),
    );
  });
});

describe("moving", () => {
  test("a hand goes an arm's length a second along each axis", () => {
    const pull = new LimbTarget(1);
    pull.take(0);
    pull.setTarget(0, 0, 0, 0);
    pull.setVelocity(1, -0.5, 2, 0);
    near(pull.valueAt(400), [0.4, -0.2, 0.4]);
    pull.setVelocity(0, 0, 0, 400);
    near(pull.valueAt(5_000), [0.4, -0.2, 0.4]);
  });

  test("a leg swings at 2 rad/s within its limits, and only by its angle", () => {
    const pull = new LimbTarget(3);
    pull.take(0);
    pull.setTarget(0, 9, 9, 0);
    pull.setVelocity(1, 1, 1, 0);
    expect([...pull.valueAt(500)]).toEqual([1, 0, 0]);
    expect(pull.valueAt(60_000)[0]).toBeCloseTo((2 * Math.PI) / 3, 12);
    pull.setVelocity(-1, 0, 0, 60_000);
    expect(pull.valueAt(120_000)[0]).toBeCloseTo(-Math.PI / 4, 12);
  });

  test("before it is placed a speed waits for the place", () => {
    const pull = new LimbTarget(0);
    pull.take(0);
    pull.setVelocity(1, 0, 0, 0);
    pull.setStart(new Float64Array(3), 100);
    near(pull.valueAt(200), [0.1, 0, 0]);
  });
});
