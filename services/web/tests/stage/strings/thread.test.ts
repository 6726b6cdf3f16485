import { Vector3 } from "three";
import { expect, test } from "vitest";
import { type Thread, Threads } from "../../../src/stage/strings/thread";

const TAUT: Thread = { colour: "#ffffff", alpha: 1, tension: 1, sag: 0, fadesOut: false };
const [FROM, TO] = [new Vector3(0.3, 1, 0.1), new Vector3(0.4, 2, 0)];

/** Return the attributes of a thread. */
function attributesOf(threads: Threads, index: number): Record<string, number[]> {
  const { foot, top, tint, shape } = threads.mesh.geometry.attributes;
  const row = ({ array, itemSize }: typeof foot) =>
    [...array.slice(index * itemSize, (index + 1) * itemSize)].map((value) => Number(value.toFixed(6)));
  return { foot: row(foot), top: row(top), tint: row(tint), shape: row(shape) };
}

test("a thread runs from its handle to its other end and changes no other", () => {
  const threads = new Threads();
  threads.count = 4;
  threads.set(1, FROM, TO, TAUT);
  threads.set(3, TO, FROM, { colour: "#ff0000", alpha: 0.4, tension: 0, sag: 0.05, fadesOut: true });
  expect(attributesOf(threads, 1)).toEqual({
    foot: [0.3, 1, 0.1],
    top: [0.4, 2, 0],
    tint: [1, 1, 1, 1],
    shape: [1, 0, 0],
  });
  expect(attributesOf(threads, 3)).toEqual({
    foot: [0.4, 2, 0],
    top: [0.3, 1, 0.1],
    tint: [1, 0, 0, 0.4],
    shape: [0, 0.05, 1],
  });
  for (const other of [0, 2])
    expect(
      Object.values(attributesOf(threads, other))
        .flat()
        .every((value) => value === 0),
    ).toBe(true);
});

test("all threads are one draw call with as many instances as there are", () => {
  const { mesh } = new Threads();
  const threads = new Threads();
  expect(mesh.geometry.instanceCount).toBe(0);
  threads.count = 16;
  expect(threads.mesh.geometry.instanceCount).toBe(16);
  const { position } = mesh.geometry.attributes;
  const heights = Array.from({ length: position.count }, (_, i) => position.getY(i));
  expect([Math.min(...heights), Math.max(...heights), position.count]).toEqual([-0.5, 0.5, 82]);
});
