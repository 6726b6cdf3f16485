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

test("an overlay reads back unchanged; one of the first performer has the shorter header", () => {
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

test("an overlay of the wrong size is refused with the expected size", () => {
  const limbs = new Map([
    [5, new Int16Array(9)],
    [0, new Int16Array(9)],
  ]);
  const bytes = packOverlay({ name: "Overlay", sequence: 1, due: 2, limbs, earlier: [limbs] });
  expect(bytes).toHaveLength(14 + 72);
  for (const size of [13, 14, 50, 85]) expect(() => unpackOverlay(bytes.subarray(0, size))).toThrow(MalformedMessage);
  expect(() => unpackOverlay(bytes.subarray(0, 13))).toThrow("Overlay has 13 bytes, expected at least 14 bytes");
  expect(() => unpackOverlay(Uint8Array.of(...bytes, 0))).toThrow(
    "Overlay has 87 bytes, expected 86 bytes for 2 frames of 2 limbs",
  );
});
