import { describe, expect, test } from "vitest";
import { MASKS, makeQrCode, multiply, type QrCode } from "../../../src/ui/crowd/qr-code";

const LINK = "https://stage.example/?session=k3v9q2#share=";

function codeOf(text: string): QrCode {
  const code = makeQrCode(text);
  if (!code) throw new Error(`no code for ${text.length} characters`);
  return code;
}

/** Blocks of the standard for the versions in these tests: number of blocks, error correction codewords of each. */
const BLOCKS: Readonly<Record<number, readonly [number, number]>> = {
  1: [1, 7],
  3: [1, 15],
  7: [2, 20],
  10: [4, 18],
  20: [8, 28],
};

/** Centres of alignment patterns in annex E of the standard. */
const CENTRES: Readonly<Record<number, readonly number[]>> = {
  1: [],
  3: [6, 22],
  7: [6, 22, 38],
  10: [6, 28, 50],
  20: [6, 34, 62, 90],
};

/** Return whether a module belongs to a function pattern. */
function isFunction(x: number, y: number, size: number): boolean {
  const version = (size - 17) / 4;
  const isNear = (a: number, b: number, distance: number) => Math.abs(a - b) <= distance;
  if (x === 6 || y === 6) return true;
  if ((x < 9 && y < 9) || (x < 9 && y >= size - 8) || (x >= size - 8 && y < 9)) return true;
  if (version >= 7 && ((x < 6 && y >= size - 11) || (y < 6 && x >= size - 11))) return true;
  const centres = CENTRES[version];
  return centres.some((cx) =>
    centres.some((cy) => {
      const isFinder = (cx === 6 && cy === 6) || (cx === 6 && cy === size - 7) || (cx === size - 7 && cy === 6);
      return !isFinder && isNear(x, cx, 2) && isNear(y, cy, 2);
    }),
  );
}

/** Read the text of a code, as a scanner does without any error; throws if a codeword is wrong. */
function readText(code: QrCode): string {
  const size = code.length;
  const version = (size - 17) / 4;
  const formatBits = [...Array(15).keys()].map((i) =>
    i < 8 ? code[i < 6 ? i : i + 1][8] : code[8][i === 8 ? 7 : 14 - i],
  );
  const format = formatBits.reduce((value, bit, i) => value | (Number(bit) << i), 0) ^ 0x5412;
  expect(format >> 13).toBe(0b01);
  const mask = MASKS[(format >> 10) & 7];
  const bits: number[] = [];
  let isUpwards = true;
  for (let right = size - 1; right > 0; right -= 2) {
    if (right === 6) right--;
    for (let i = 0; i < size; i++) {
      const y = isUpwards ? size - 1 - i : i;
      for (const x of [right, right - 1]) if (!isFunction(x, y, size)) bits.push(Number(code[y][x] !== mask(x, y)));
    }
    isUpwards = !isUpwards;
  }
  const codewords = Array.from({ length: bits.length >> 3 }, (_, i) =>
    bits.slice(8 * i, 8 * i + 8).reduce((value, bit) => 2 * value + bit, 0),
  );
  const [count, correction] = BLOCKS[version];
  const shortLength = Math.floor(codewords.length / count);
  const lengths = Array.from(
    { length: count },
    (_, i) => shortLength + Number(i >= count - (codewords.length % count)),
  );
  const blocks: number[][] = lengths.map(() => []);
  let at = 0;
  for (let i = 0; i < shortLength + 1 - correction; i++)
    lengths.forEach((length, block) => i < length - correction && blocks[block].push(codewords[at++]));
  const data = blocks.flatMap((block) => [...block]);
  for (let i = 0; i < correction; i++) for (const block of blocks) block.push(codewords[at++]);
  // A valid block is zero at each root of the generator polynomial.
  for (const block of blocks)
    for (let i = 0, root = 1; i < correction; i++, root = multiply(root, 2))
      expect(block.reduce((value, codeword) => multiply(value, root) ^ codeword, 0)).toBe(0);
  const nibbles = data.flatMap((byte) => [byte >> 4, byte & 15]);
  expect(nibbles[0]).toBe(4);
  const lengthNibbles = version < 10 ? 2 : 4;
  const length = nibbles.slice(1, 1 + lengthNibbles).reduce((value, nibble) => 16 * value + nibble, 0);
  const content = nibbles.slice(1 + lengthNibbles, 1 + lengthNibbles + 2 * length);
  return new TextDecoder().decode(Uint8Array.from({ length }, (_, i) => 16 * content[2 * i] + content[2 * i + 1]));
}

describe("codes", () => {
  test.each([
    [1, "http://1.2.3.4"],
    [3, LINK],
    [7, LINK + "x".repeat(100)],
    [10, LINK + "y".repeat(200)],
    [20, LINK + "z".repeat(800)],
    [3, "https://stage.example/?name=文楽"],
  ])("a code of version %d is read back without errors", (version, text) => {
    const code = codeOf(text);
    expect(code.length).toBe(17 + 4 * version);
    expect(readText(code)).toBe(text);
  });

  test("version information of version 7 is that of the standard", () => {
    const code = codeOf(LINK + "x".repeat(100));
    const bits = [...Array(18).keys()].map((i) => Number(code[Math.floor(i / 3)][code.length - 11 + (i % 3)]));
    // Annex D: 07C94
    expect(bits.reduce((value, bit, i) => value | (bit << i), 0)).toBe(0x07c94);
  });

  test("each version is used up to its capacity, and longer texts have no code", () => {
    expect([17, 18, 230, 231, 271, 272].map((length) => (codeOf("a".repeat(length)).length - 17) / 4)).toEqual([
      1, 2, 9, 10, 10, 11,
    ]);
    expect([makeQrCode("a".repeat(858)) !== null, makeQrCode("a".repeat(859))]).toEqual([true, null]);
  });
});
