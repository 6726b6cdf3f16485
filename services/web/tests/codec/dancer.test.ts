import { expect, test } from "vitest";
import { unpackDancer } from "../../src/codec/dancer";
import { DamagedBlock } from "../../src/codec/errors";
import type { BlockVectors } from "../golden";
import { Outcome } from "../outcome";
import { bytes, vectors } from "../vectors";

test("dancers are read as Python wrote them", () => {
  for (const { dancer, offsets, tips, reference } of vectors<BlockVectors>("blocks").tracks) {
    const { figure, reference: turned } = unpackDancer(bytes(dancer));
    offsets.forEach((value, i) => expect(figure.offsets[i]).toBeCloseTo(value, 12));
    tips.forEach((value, i) => expect(figure.tips[i]).toBeCloseTo(value, 12));
    // a rotation and its negative are the same
    for (let joint = 0; joint < 18; joint++) {
      const part = (of: ArrayLike<number>) => Array.from(of).slice(joint * 4, joint * 4 + 4);
      const [a, b] = [part(turned), part(reference)];
      const dot = a.reduce((sum, value, i) => sum + value * b[i], 0);
      expect(Math.abs(dot)).toBeCloseTo(1, 12);
    }
  }
});

test("what is no dancer is refused, and any other bytes are one", () => {
  expect(() => unpackDancer(new Uint8Array(0))).toThrow(DamagedBlock);
  expect(() => unpackDancer(new Uint8Array(1025))).toThrow(DamagedBlock);
  expect(() => unpackDancer(Uint8Array.of(15, 1, 2))).toThrow("finest");
  const outcome = new Outcome(DamagedBlock);
  for (let seed = 1; seed <= 2000; seed++) {
    const data = Uint8Array.from({ length: seed % 120 }, (_, i) => (seed * 2654435761 + i * i * 40503) >>> 11);
    if (data.length > 0) data[0] %= 15;
    outcome.of(() => expect(unpackDancer(data).figure.offsets.every(Number.isFinite)).toBe(true));
  }
  outcome.tell("dancers");
});
