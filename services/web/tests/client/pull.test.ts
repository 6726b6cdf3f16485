import { describe, expect, test } from "vitest";
import { Pull } from "../../src/client/pull";
import type { Solver } from "../../src/client/solver";
import { type Pose, restPose } from "../../src/motion/skeleton";

/** A figure whose limb's target stands in the root's position: what is laid can be read there. */
class Plain implements Solver {
  rested: number[] = [];
  target(pose: Pose, _limb: number, out: Float64Array): void {
    out.set(pose.root);
  }
  solve(pose: Pose, _limb: number, target: Float64Array): void {
    pose.root.set(target);
  }
  rest(limb: number): void {
    this.rested.push(limb);
  }
}

/** Where `pull` is drawn at `now` over a dance that has it at `dance`. */
function drawn(pull: Pull, now: number, dance: [number, number, number], solver = new Plain()): number[] {
  const pose = restPose();
  pose.root.set(dance);
  pull.lay(pose, now, solver);
  return [...pose.root];
}

const DANCE: [number, number, number] = [0.1, -0.8, 0.2];

test("a limb nobody holds is left alone", () => {
  const pose = restPose();
  expect(new Pull(0).lay(pose, 0, new Plain())).toBe(false);
  expect(pose).toEqual(restPose());
});

test("taken, it stays where it was when it was taken, whatever the dance does", () => {
  const pull = new Pull(0);
  pull.take(0);
  drawn(pull, 0, DANCE);
  drawn(pull, 200, [0.5, 0, 0]);
  const held = drawn(pull, 1_000, [0, 0.5, 0]);
  held.forEach((value, axis) => expect(value).toBeCloseTo(DANCE[axis], 12));
});

describe("handing over", () => {
  test("is whole after 150 ms and never steps", () => {
    const pull = new Pull(0);
    drawn(pull, 0, [0.1, 0, 0]);
    pull.take(0);
    pull.target(0.6, 0, 0, 0);
    let before = 0.1;
    for (let now = 1; now <= 150; now++) {
      const [x] = drawn(pull, now, [0.1, 0, 0]);
      expect(x).toBeGreaterThanOrEqual(before);
      expect(x - before).toBeLessThan(0.5 * 0.0126);
      before = x;
    }
    expect(before).toBeCloseTo(0.6, 12);
  });

  test("goes round the shoulder, not through it", () => {
    for (const [from, to] of [[[0.5, 0, 0], [-0.7, 0, 0]], [[0, 0, 0.5], [0, 0, -0.7]], [[0.3, -0.4, 0], [-0.4, 0.5, 0.1]]]) {
      const pull = new Pull(1);
      const [a, b, c] = from, [x, y, z] = to;
      pull.take(0);
      pull.target(x, y, z, 0);
      let before = drawn(pull, 0, [a, b, c]);
      for (let now = 1; now <= 150; now++) {
        const here = drawn(pull, now, [a, b, c]);
        expect(Math.hypot(...here)).toBeGreaterThan(0.49);
        expect(Math.hypot(...here.map((value, axis) => value - before[axis]))).toBeLessThan(0.04);
        before = here;
      }
      to.forEach((value, axis) => expect(before[axis]).toBeCloseTo(value, 12));
    }
  });

  test("back takes 300 ms and ends with the dance untouched", () => {
    const pull = new Pull(2), solver = new Plain();
    pull.take(0);
    drawn(pull, 0, [0, 0, 0], solver);
    pull.target(1, 0, 0, 0);
    expect(drawn(pull, 200, [0, 0, 0], solver)[0]).toBeCloseTo(1, 12);
    pull.letGo(200);
    expect(drawn(pull, 350, [0, 0, 0], solver)[0]).toBeCloseTo(0.5, 9);
    expect(drawn(pull, 500, [0.25, 0, 0], solver)[0]).toBe(0.25);
    expect(solver.rested).toEqual([2]);
    expect(pull.lay(restPose(), 600, solver)).toBe(false);
  });

  test("taken again on the way back it goes on from there", () => {
    const pull = new Pull(0);
    pull.take(0);
    drawn(pull, 0, [0.1, 0, 0]);
    pull.target(0.8, 0, 0, 0);
    drawn(pull, 200, [0.1, 0, 0]);
    pull.letGo(200);
    const [x] = drawn(pull, 300, [0.1, 0, 0]);
    pull.take(300);
    const [y] = drawn(pull, 301, [0.1, 0, 0]);
    expect(Math.abs(y - x)).toBeLessThan(0.02);
    expect(drawn(pull, 500, [0.1, 0, 0])[0]).toBeCloseTo(0.8, 12);
  });
});

describe("moving", () => {
  test("a hand goes an arm's length a second along each axis", () => {
    const pull = new Pull(1);
    pull.take(0);
    pull.target(0, 0, 0, 0);
    pull.speed(1, -0.5, 2, 0);
    pull.move(400);
    [0.4, -0.2, 0.4].forEach((value, axis) => expect(pull.value[axis]).toBeCloseTo(value, 12));
    pull.speed(0, 0, 0, 400);
    pull.move(5_000);
    expect(pull.value[0]).toBeCloseTo(0.4, 12);
  });

  test("no farther than the arm is long, keeping the direction", () => {
    const pull = new Pull(0);
    pull.target(3, 0, 4, 0);
    expect([...pull.value]).toEqual([0.6000000000000001, 0, 0.8]);
  });

  test("a leg swings at 2 rad/s within its limits, and only by its angle", () => {
    const pull = new Pull(3);
    pull.take(0);
    pull.target(0, 9, 9, 0);
    pull.speed(1, 1, 1, 0);
    pull.move(500);
    expect([...pull.value]).toEqual([1, 0, 0]);
    pull.move(60_000);
    expect(pull.value[0]).toBeCloseTo((2 * Math.PI) / 3, 12);
    pull.speed(-1, 0, 0, 60_000);
    pull.move(120_000);
    expect(pull.value[0]).toBeCloseTo(-Math.PI / 4, 12);
  });

  test("before it is placed a speed waits for the place", () => {
    const pull = new Pull(0);
    pull.take(0);
    pull.speed(1, 0, 0, 0);
    drawn(pull, 100, [0, 0, 0]);
    pull.move(200);
    expect(pull.value[0]).toBeCloseTo(0.1, 12);
  });
});
