import * as fc from "fast-check";
import { expect, test } from "vitest";
import { DamagedBlock } from "../../src/codec/errors";
import { unpackSkeletonDescription } from "../../src/codec/skeleton-description";
import { fromRotationVector } from "../../src/motion/rotation";
import { JOINTS, TIP_JOINTS } from "../../src/motion/skeleton";
import type { BlockVectors } from "../golden-motion";
import { decodeBase64, loadVectors } from "../golden-vectors";
import { HostileInputCounts } from "../hostile-input";
import { encodeBits } from "./range-encoder";

test("golden skeletons are decoded", () => {
  for (const { dancer, offsets, tips, reference } of loadVectors<BlockVectors>("blocks").tracks) {
    const { figure, reference: decoded } = unpackSkeletonDescription(decodeBase64(dancer));
    offsets.forEach((value, i) => expect(figure.offsets[i]).toBeCloseTo(value, 12));
    tips.forEach((value, i) => expect(figure.tips[i]).toBeCloseTo(value, 12));
    expect(reference.length).toBe(decoded.length);
    // a rotation and its negative are the same
    for (let joint = 0; joint < 18; joint++) {
      const part = (of: ArrayLike<number>) => Array.from(of).slice(joint * 4, joint * 4 + 4);
      const [a, b] = [part(decoded), part(reference)];
      const dot = a.reduce((sum, value, i) => sum + value * b[i], 0);
      expect(Math.abs(dot)).toBeCloseTo(1, 12);
    }
  }
});

const LENGTHS = [...JOINTS, ...TIP_JOINTS.map((joint) => `${JOINTS[joint]} tip`)];
const ROWS = [...LENGTHS, ...JOINTS.map((name) => `${name} reference`)];

/** A coded integer: its value, or if mirrored the difference of magnitudes and whether the signs differ. */
interface CodedInteger {
  value: number;
  differs: boolean;
}

/** Encodes a skeleton description as the specification defines it; returns the integers up to the first invalid one. */
function encodeSkeleton(header: number, coded: readonly CodedInteger[]): { data: Uint8Array; integers: number[] } {
  const bits: { bit: number; probability: number }[] = [];
  const models = new Map<string, number>();
  const encodeAdaptive = (model: string, start: number, bit: number) => {
    const probability = models.get(model) ?? start;
    bits.push({ bit, probability });
    models.set(model, Math.min(Math.max(probability + Math.floor(((bit ? 32768 : 0) - probability) / 8), 1024), 31744));
  };
  const encodeEven = (bit: number) => bits.push({ bit, probability: 16384 });
  const integers: number[] = [];
  coded.every(({ value, differs }, i) => {
    const name = ROWS[Math.floor(i / 3)];
    const mirrored = name.startsWith("r_") ? integers[ROWS.indexOf(`l${name.slice(1)}`) * 3 + (i % 3)] : null;
    const group = `${name.endsWith("reference")} ${mirrored === null ? i % 3 : "mirrored"}`;
    const code = Math.abs(value) + 1,
      length = Math.floor(Math.log2(code));
    for (let bit = 0; bit < length && bit < 17; bit++) encodeAdaptive(`${group} ${bit}`, 22938, 1);
    if (length >= 17) return false;
    encodeAdaptive(`${group} ${length}`, 22938, 0);
    for (let bit = length - 1; bit >= 0; bit--) encodeEven((code >> bit) & 1);
    if (value !== 0) encodeEven(value < 0 ? 1 : 0);
    if (mirrored === null) return integers.push(value);
    const magnitude = Math.abs(mirrored) + value;
    if (magnitude < 0) return false;
    if (magnitude > 0) encodeAdaptive(group, 16384, differs ? 1 : 0);
    return integers.push(magnitude > 0 && mirrored < 0 !== differs ? -magnitude : magnitude);
  });
  return { data: Uint8Array.of(header, ...encodeBits(bits)), integers };
}

const mostlyZero = fc.oneof(
  { weight: 3, arbitrary: fc.constant(0) },
  fc.integer({ min: -40, max: 40 }),
  fc.integer({ min: -131_070, max: 131_070 }),
);
const codedIntegers = fc.array(fc.record({ value: mostlyZero, differs: fc.boolean() }), {
  minLength: 123,
  maxLength: 123,
});

/** Coded integers of which no mirrored one has a negative magnitude. */
const validIntegers = codedIntegers.map((coded) =>
  coded.map((entry, i) =>
    ROWS[Math.floor(i / 3)].startsWith("r_") ? { ...entry, value: Math.abs(entry.value) } : entry,
  ),
);

test("integers are decoded as specified on any grid and with any bits", () => {
  fc.assert(
    fc.property(fc.nat(7), fc.nat(14), validIntegers, (grid, bits, coded) => {
      const { data, integers } = encodeSkeleton((grid << 4) | bits, coded);
      const { figure, reference } = unpackSkeletonDescription(data);
      const offsets = [...figure.offsets],
        tips = TIP_JOINTS.flatMap((joint) => [...figure.tips.subarray(joint * 3, joint * 3 + 3)]);
      [...offsets, ...tips].forEach((value, i) => expect(Math.round(value / (1e-4 * 2 ** grid))).toBe(integers[i]));
      expect(figure.tips.filter((value) => value !== 0).length).toBe(tips.filter((value) => value !== 0).length);
      const expected = new Float64Array(4);
      for (let joint = 0; joint < 18; joint++) {
        const [x, y, z] = integers.slice((LENGTHS.length + joint) * 3).map((value) => value / 2 ** bits);
        fromRotationVector(expected, 0, x, y, z);
        expected.forEach((value, i) => expect(reference[joint * 4 + i]).toBeCloseTo(value, 12));
      }
    }),
  );
});

test("only negative magnitudes are refused", () => {
  fc.assert(
    fc.property(codedIntegers, (coded) => {
      const { data, integers } = encodeSkeleton(0x12, coded);
      if (integers.length === coded.length) unpackSkeletonDescription(data);
      else expect(() => unpackSkeletonDescription(data)).toThrow("negative magnitude");
    }),
  );
});

test("integer of more than 17 bits is refused", () => {
  const coded = Array.from({ length: 123 }, () => ({ value: 0, differs: false }));
  expect(
    unpackSkeletonDescription(encodeSkeleton(0, coded.with(40, { value: 2 ** 17 - 2, differs: false })).data),
  ).toBeDefined();
  const { data } = encodeSkeleton(0, coded.with(40, { value: 2 ** 17 - 1, differs: false }));
  expect(() => unpackSkeletonDescription(data)).toThrow(DamagedBlock);
  expect(() => unpackSkeletonDescription(data)).toThrow("17 or more bits");
});

test("arbitrary bytes decode to finite lengths or are refused", () => {
  expect(() => unpackSkeletonDescription(new Uint8Array(0))).toThrow(DamagedBlock);
  expect(() => unpackSkeletonDescription(new Uint8Array(1025))).toThrow(DamagedBlock);
  expect(() => unpackSkeletonDescription(Uint8Array.of(15, 1, 2))).toThrow("15 reference bits");
  expect(() => unpackSkeletonDescription(Uint8Array.of(0x80, 1, 2))).toThrow("grid 8");
  const outcome = new HostileInputCounts(DamagedBlock);
  for (let seed = 1; seed <= 2000; seed++) {
    const data = Uint8Array.from({ length: seed % 120 }, (_, i) => (seed * 2654435761 + i * i * 40503) >>> 11);
    if (data.length > 0) data[0] = ((seed % 8) << 4) | (seed % 15);
    outcome.run(() => expect(unpackSkeletonDescription(data).figure.offsets.every(Number.isFinite)).toBe(true));
  }
  outcome.print("skeleton descriptions");
});
