import * as fc from "fast-check";
import { expect, test } from "vitest";
import { MalformedMessage } from "../../src/wire/errors";
import { type Overlay, packOverlay, unpackOverlay } from "../../src/wire/overlay";

const number = fc.integer({ min: -32768, max: 32767 });
const numbers = fc.array(number, { minLength: 9, maxLength: 9 }).map((all) => Int16Array.from(all));
const overlays = fc.uniqueArray(fc.nat(15)).chain((limbs) =>
  fc
    .record({
      name: fc.constant("Overlay" as const),
      sequence: fc.nat(0xffff),
      due: fc.integer({ min: 0, max: Number.MAX_SAFE_INTEGER }),
      frames: fc.array(fc.tuple(...limbs.map(() => numbers)), { minLength: 1, maxLength: 16 }),
    })
    .map(({ frames, ...rest }): Overlay => {
      const earlier = frames.map((frame) => new Map(limbs.map((limb, nth) => [limb, frame[nth]])));
      return { ...rest, limbs: earlier.pop()!, earlier };
    }),
);

test("an overlay of any performers comes back frame by frame, and of the first alone is the shorter message", () => {
  fc.assert(
    fc.property(overlays, (overlay) => {
      const bytes = packOverlay(overlay);
      const limbs = [...overlay.limbs.keys()];
      const head = limbs.every((limb) => limb < 4) ? 12 : 14;
      expect(bytes[0]).toBe(head === 12 ? 5 : 14);
      expect(bytes).toHaveLength(head + 18 * limbs.length * (overlay.earlier.length + 1));
      expect(unpackOverlay(bytes)).toEqual(overlay);
    }),
  );
});

test("one that is cut short or too long is refused with its size", () => {
  const limbs = new Map([
    [5, new Int16Array(9)],
    [0, new Int16Array(9)],
  ]);
  const bytes = packOverlay({ name: "Overlay", sequence: 1, due: 2, limbs, earlier: [limbs] });
  expect(bytes).toHaveLength(14 + 72);
  for (const size of [13, 14, 50, 85]) expect(() => unpackOverlay(bytes.subarray(0, size))).toThrow(MalformedMessage);
  expect(() => unpackOverlay(bytes.subarray(0, 13))).toThrow("Overlay has 14 bytes at least");
  expect(() => unpackOverlay(Uint8Array.of(...bytes, 0))).toThrow(
    "Overlay of 2 frames of 2 limbs has 86 bytes, not 87",
  );
});
