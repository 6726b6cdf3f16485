import * as fc from "fast-check";
import { expect, test } from "vitest";
import { Follower } from "../../src/marionette/follower";
import { distanceBetween, length } from "../../src/motion/vector";

const ZERO_VELOCITY = new Float64Array(3);
const part = fc.double({ min: -0.55, max: 0.55, noNaN: true });
const position = fc.tuple(part, part, part).map((parts) => Float64Array.from(parts));
const seconds = fc.constantFrom(1 / 144, 1 / 60, 1 / 20);

test("acceleration is bounded and the limb arrives at rest", () => {
  fc.assert(
    fc.property(position, fc.array(position, { minLength: 1, maxLength: 6 }), seconds, (start, targets, dt) => {
      const follower = new Follower(start, ZERO_VELOCITY);
      const before = follower.velocity.slice();
      for (const target of targets) {
        for (let t = 0; t < 1; t += dt) {
          follower.step(target, dt, 75);
          expect(distanceBetween(follower.velocity, 0, before, 0)).toBeLessThanOrEqual(75 * dt * (1 + 1e-9) + 1e-9);
          before.set(follower.velocity);
        }
        expect(distanceBetween(follower.position, 0, target, 0)).toBeLessThan(1e-6);
        expect(length(follower.velocity, 0)).toBeLessThan(1e-3);
      }
    }),
    { numRuns: 60 },
  );
});

test("acceleration relative to a moving frame is bounded and the limb arrives", () => {
  fc.assert(
    fc.property(
      position,
      position,
      seconds,
      fc.double({ min: 0.2, max: 3, noNaN: true }),
      (start, centre, dt, hertz) => {
        const follower = new Follower(start, ZERO_VELOCITY);
        const moving = centre.slice(),
          frameVelocity = new Float64Array(3),
          relativeVelocity = new Float64Array(3);
        let before: Float64Array | null = null;
        for (let step = 1; step * dt < 1.5; step++) {
          for (let i = 0; i < 3; i++) {
            const next = centre[i] + 0.3 * Math.sin(2 * Math.PI * hertz * step * dt + i);
            frameVelocity[i] = step > 1 ? (next - moving[i]) / dt : 0;
            moving[i] = next;
          }
          follower.step(moving, dt, 60, 0, Infinity, frameVelocity);
          for (let i = 0; i < 3; i++) relativeVelocity[i] = follower.velocity[i] - frameVelocity[i];
          if (before)
            expect(distanceBetween(relativeVelocity, 0, before, 0)).toBeLessThanOrEqual(60 * dt * (1 + 1e-9) + 1e-9);
          before = relativeVelocity.slice();
        }
        expect(distanceBetween(follower.position, 0, moving, 0)).toBeLessThan(1e-6);
      },
    ),
    { numRuns: 60 },
  );
});

test("target at constant velocity is followed exactly", () => {
  const follower = new Follower(Float64Array.of(0.3, -0.5, 0), ZERO_VELOCITY);
  const target = Float64Array.of(0.3, -0.5, 0);
  for (let frame = 0; frame < 60; frame++) {
    target[2] += 0.5 / 60;
    follower.step(target, 1 / 60, 75);
    if (frame > 10) expect(distanceBetween(follower.position, 0, target, 0)).toBeLessThan(1e-9);
  }
});

test("path avoids the shoulder and stays within its bounds", () => {
  fc.assert(
    fc.property(position, position, (start, end) => {
      const minDistance = Math.min(length(start, 0), length(end, 0));
      fc.pre(minDistance > 0.2);
      const follower = new Follower(start, ZERO_VELOCITY);
      for (let frame = 0; frame < 120; frame++) {
        follower.step(end, 1 / 60, 75, 0.15, 0.9);
        const reach = length(follower.position, 0);
        expect(reach).toBeGreaterThanOrEqual(0.15 - 1e-12);
        expect(reach).toBeLessThanOrEqual(0.9 + 1e-12);
      }
      if (length(end, 0) < 0.9) expect(distanceBetween(follower.position, 0, end, 0)).toBeLessThan(1e-6);
    }),
    { numRuns: 60 },
  );
});

test("step of zero duration moves nothing", () => {
  const follower = new Follower(Float64Array.of(0.1, 0.2, 0.3), Float64Array.of(1, 0, 0));
  follower.step(ZERO_VELOCITY, 0, 75);
  expect([...follower.position]).toEqual([0.1, 0.2, 0.3]);
});
