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

test("dancers are read as Python wrote them", () => {
  for (const { dancer, offsets, tips, reference } of loadVectors<BlockVectors>("blocks").tracks) {
    const { figure, reference: turned } = unpackSkeletonDescription(decodeBase64(dancer));
    offsets.forEach((value, i) => expect(figure.offsets[i]).toBeCloseTo(value, 12));
    tips.forEach((value, i) => expect(figure.tips[i]).toBeCloseTo(value, 12));
    expect(reference.length).toBe(turned.length);
    // a rotation and its negative are the same
    for (let joint = 0; joint < 18; joint++) {
      const part = (of: ArrayLike<number>) => Array.from(of).slice(joint * 4, joint * 4 + 4);
      const [a, b] = [part(turned), part(reference)];
      const dot = a.reduce((sum, value, i) => sum + value * b[i], 0);
      expect(Math.abs(dot)).toBeCloseTo(1, 12);
    }
  }
});

const LENGTHS = [...JOINTS, ...TIP_JOINTS.map((joint) => `${JOINTS[joint]} tip`)];
const ROWS = [...LENGTHS, ...JOINTS.map((name) => `${name} reference`)];

/** What is said of a number: itself, or of one with a twin how much larger its size is, and whether its sign differs. */
interface CodedInteger {
  value: number;
  differs: boolean;
}

/** A dancer of numbers as told, by the words of the contract: its bytes, and the numbers, up to one that cannot be. */
function encodeSkeleton(first: number, told: readonly CodedInteger[]): { data: Uint8Array; numbers: number[] } {
  const bits: { bit: number; probability: number }[] = [];
  const models = new Map<string, number>();
  const learn = (model: string, start: number, bit: number) => {
    const probability = models.get(model) ?? start;
    bits.push({ bit, probability });
    models.set(model, Math.min(Math.max(probability + Math.floor(((bit ? 32768 : 0) - probability) / 8), 1024), 31744));
  };
  const even = (bit: number) => bits.push({ bit, probability: 16384 });
  const numbers: number[] = [];
  told.every(({ value, differs }, i) => {
    const name = ROWS[Math.floor(i / 3)];
    const twin = name.startsWith("r_") ? numbers[ROWS.indexOf(`l${name.slice(1)}`) * 3 + (i % 3)] : null;
    const group = `${name.endsWith("reference")} ${twin === null ? i % 3 : "twin"}`;
    const size = Math.abs(value) + 1,
      length = Math.floor(Math.log2(size));
    for (let bit = 0; bit < length && bit < 17; bit++) learn(`${group} ${bit}`, 22938, 1);
    if (length >= 17) return false;
    learn(`${group} ${length}`, 22938, 0);
    for (let bit = length - 1; bit >= 0; bit--) even((size >> bit) & 1);
    if (value !== 0) even(value < 0 ? 1 : 0);
    if (twin === null) return numbers.push(value);
    const own = Math.abs(twin) + value;
    if (own < 0) return false;
    if (own > 0) learn(group, 16384, differs ? 1 : 0);
    return numbers.push(own > 0 && twin < 0 !== differs ? -own : own);
  });
  return { data: Uint8Array.of(first, ...encodeBits(bits)), numbers };
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

/** Of twins, sizes that are never below none. */
const validIntegers = codedIntegers.map((told) =>
  told.map((each, i) => (ROWS[Math.floor(i / 3)].startsWith("r_") ? { ...each, value: Math.abs(each.value) } : each)),
);

test("any numbers are read by the contract's words, on any grid and with any bits", () => {
  fc.assert(
    fc.property(fc.nat(7), fc.nat(14), validIntegers, (grid, bits, told) => {
      const { data, numbers } = encodeSkeleton((grid << 4) | bits, told);
      const { figure, reference } = unpackSkeletonDescription(data);
      const offsets = [...figure.offsets],
        tips = TIP_JOINTS.flatMap((joint) => [...figure.tips.subarray(joint * 3, joint * 3 + 3)]);
      [...offsets, ...tips].forEach((value, i) => expect(Math.round(value / (1e-4 * 2 ** grid))).toBe(numbers[i]));
      expect(figure.tips.filter((value) => value !== 0).length).toBe(tips.filter((value) => value !== 0).length);
      const wanted = new Float64Array(4);
      for (let joint = 0; joint < 18; joint++) {
        const [x, y, z] = numbers.slice((LENGTHS.length + joint) * 3).map((number) => number / 2 ** bits);
        fromRotationVector(wanted, 0, x, y, z);
        wanted.forEach((value, i) => expect(reference[joint * 4 + i]).toBeCloseTo(value, 12));
      }
    }),
  );
});

test("sizes below none are refused, and only they", () => {
  fc.assert(
    fc.property(codedIntegers, (told) => {
      const { data, numbers } = encodeSkeleton(0x12, told);
      if (numbers.length === told.length) unpackSkeletonDescription(data);
      else expect(() => unpackSkeletonDescription(data)).toThrow("less than none");
    }),
  );
});

test("a number of more than 17 bits is refused", () => {
  const told = Array.from({ length: 123 }, () => ({ value: 0, differs: false }));
  expect(
    unpackSkeletonDescription(encodeSkeleton(0, told.with(40, { value: 2 ** 17 - 2, differs: false })).data),
  ).toBeDefined();
  const { data } = encodeSkeleton(0, told.with(40, { value: 2 ** 17 - 1, differs: false }));
  expect(() => unpackSkeletonDescription(data)).toThrow(DamagedBlock);
  expect(() => unpackSkeletonDescription(data)).toThrow("longer than 17 bits");
});

test("of any bytes comes a dancer of finite lengths or a refusal", () => {
  expect(() => unpackSkeletonDescription(new Uint8Array(0))).toThrow(DamagedBlock);
  expect(() => unpackSkeletonDescription(new Uint8Array(1025))).toThrow(DamagedBlock);
  expect(() => unpackSkeletonDescription(Uint8Array.of(15, 1, 2))).toThrow("2^-15 radians");
  expect(() => unpackSkeletonDescription(Uint8Array.of(0x80, 1, 2))).toThrow("grid is 8");
  const outcome = new HostileInputCounts(DamagedBlock);
  for (let seed = 1; seed <= 2000; seed++) {
    const data = Uint8Array.from({ length: seed % 120 }, (_, i) => (seed * 2654435761 + i * i * 40503) >>> 11);
    if (data.length > 0) data[0] = ((seed % 8) << 4) | (seed % 15);
    outcome.run(() => expect(unpackSkeletonDescription(data).figure.offsets.every(Number.isFinite)).toBe(true));
  }
  outcome.print("dancers");
});
