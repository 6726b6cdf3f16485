import { Vector3 } from "three";
import { expect, test } from "vitest";
import { Threads, type Thread } from "../../src/stage/threads";

const TAUT: Thread = { colour: "#ffffff", alpha: 1, tension: 1, sag: 0, fading: false };
const [FROM, TO] = [new Vector3(0.3, 1, 0.1), new Vector3(0.4, 2, 0)];
const VERTICES = 82;

/** Place and alpha along one thread, from its handle up. */
function drawn(threads: Threads, index: number): { at: Vector3; alpha: number }[] {
  const { position, tint } = threads.mesh.geometry.attributes;
  return Array.from({ length: VERTICES / 2 }, (_, i) => {
    const vertex = index * VERTICES + i * 2;
    return { at: new Vector3().fromBufferAttribute(position, vertex), alpha: tint.getW(vertex) };
  });
}

test("a thread goes from its handle to its other end, straight when taut, and touches no other", () => {
  const threads = new Threads();
  threads.set(1, FROM, TO, TAUT);
  const points = drawn(threads, 1);
  expect(points[0].at.distanceTo(FROM)).toBeLessThan(1e-6);
  expect(points[40].at.distanceTo(TO)).toBeLessThan(1e-6);
  expect(points[20].at.distanceTo(FROM.clone().lerp(TO, 0.5))).toBeLessThan(1e-6);
  for (const other of [0, 2, 3]) expect(drawn(threads, other).every(({ at, alpha }) => at.length() === 0 && alpha === 0)).toBe(true);
});

test("a slack thread hangs through in the middle; a free one dissolves upwards", () => {
  const threads = new Threads();
  threads.set(0, FROM, TO, { ...TAUT, sag: 0.05, fading: true });
  const points = drawn(threads, 0);
  expect(points[20].at.y).toBeCloseTo(1.5 - 0.05, 6);
  expect(points[40].at.distanceTo(TO)).toBeLessThan(1e-6);
  expect([points[0].alpha, points[40].alpha]).toEqual([1, 0]);
  for (let i = 1; i <= 40; i++) expect(points[i].alpha).toBeLessThan(points[i - 1].alpha);
});
