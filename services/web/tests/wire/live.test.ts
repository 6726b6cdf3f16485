import * as fc from "fast-check";
import { expect, test } from "vitest";
import { MalformedMessage } from "../../src/wire/errors";
import { type Live, packLive, unpackLive } from "../../src/wire/live";
import { HostileInputCounts } from "../hostile-input";

const block = fc.record({
  ageUs: fc.nat(255).map((units) => units * 4_000),
  data: fc.uint8Array({ maxLength: 300, size: "max" }),
});
const lives: fc.Arbitrary<Live> = fc.record({
  name: fc.constant("Live" as const),
  due: fc.integer({ min: 0, max: Number.MAX_SAFE_INTEGER }),
  frames: fc.integer({ min: 1, max: 16 }),
  blocks: fc
    .uniqueArray(fc.tuple(fc.nat(3), block), { selector: ([performer]) => performer })
    .map((all) => new Map(all)),
});

test("a message reads back unchanged, in 10 bytes and 2 or 3 and the block of each performer", () => {
  fc.assert(
    fc.property(lives, (live) => {
      const bytes = packLive(live);
      const sizes = [...live.blocks.values()].map(({ data }) => data.length + (data.length < 128 ? 2 : 3));
      expect(bytes).toHaveLength(sizes.reduce((a, b) => a + b, 10));
      expect(unpackLive(bytes)).toEqual(live);
    }),
  );
});

test("a block may have 16,383 bytes", () => {
  const data = new Uint8Array(16_383).fill(7);
  const bytes = packLive({ name: "Live", due: 1, frames: 1, blocks: new Map([[0, { ageUs: 0, data }]]) });
  expect([...bytes.subarray(11, 13)]).toEqual([255, 127]);
  expect(unpackLive(bytes).blocks.get(0)!.data).toHaveLength(16_383);
});

test("an age is rounded to its unit and limited", () => {
  const age = (ageUs: number) =>
    unpackLive(
      packLive({ name: "Live", due: 0, frames: 1, blocks: new Map([[2, { ageUs, data: new Uint8Array() }]]) }),
    ).blocks.get(2)!.ageUs;
  expect([age(0), age(5_999), age(6_001), age(9e9)]).toEqual([0, 4_000, 8_000, 1_020_000]);
});

test("a message that is cut anywhere is refused", () => {
  const data = Uint8Array.from({ length: 200 }, (_, i) => i);
  const bytes = packLive({
    name: "Live",
    due: 7,
    frames: 2,
    blocks: new Map([
      [0, { ageUs: 0, data }],
      [3, { ageUs: 0, data: data.subarray(0, 20) }],
    ]),
  });
  for (let size = 1; size < bytes.length; size++)
    expect(() => unpackLive(bytes.subarray(0, size))).toThrow(MalformedMessage);
  expect(() => unpackLive(Uint8Array.of(...bytes, 0, 0))).toThrow("Live has 2 bytes after its last block");
  expect(() => unpackLive(bytes.subarray(0, -1))).toThrow(`expected at least ${bytes.length} bytes`);
  expect(() => unpackLive(bytes.subarray(0, 9))).toThrow("Live has 9 bytes, expected at least 10 bytes");
});

test("a time of 2^53 or more is refused", () => {
  const bytes = packLive({ name: "Live", due: 0, frames: 1, blocks: new Map() });
  bytes.fill(255, 2);
  expect(() => unpackLive(bytes)).toThrow("Live, due is 2^53 or more");
});

test("arbitrary bytes are a message or malformed", () => {
  const outcome = new HostileInputCounts(MalformedMessage);
  fc.assert(
    fc.property(fc.uint8Array({ maxLength: 80, size: "max" }), fc.boolean(), (rest, isPlausible) => {
      // a time below 2^53 and two short blocks
      if (isPlausible && rest.length > 14) {
        rest.fill(0, 7, 9);
        rest[0] = (rest[0] & 0xf0) | 5;
        rest[10] = 2;
        rest[14] = rest.length - 15;
      }
      outcome.run(() => {
        const live = unpackLive(Uint8Array.of(15, ...rest));
        expect(unpackLive(packLive(live))).toEqual(live);
      });
    }),
    { numRuns: 3000 },
  );
  outcome.print("live messages");
});
