/** QR codes of texts: byte mode, versions 1 to 20, error correction level L (ISO/IEC 18004). Pure. */

/** Square of modules, row by row; true is dark. Without the quiet zone. */
export type QrCode = readonly (readonly boolean[])[];

/** Error correction codewords per block, and number of blocks, of the versions 1 to 20 at level L (table 9). */
const CORRECTION_LENGTHS = [7, 10, 15, 20, 26, 18, 20, 24, 30, 18, 20, 24, 26, 30, 22, 24, 28, 30, 28, 28];
const BLOCK_COUNTS = [1, 1, 1, 1, 1, 2, 2, 2, 2, 4, 4, 4, 4, 4, 6, 6, 6, 6, 7, 8];
/** Bits of level L in the format information (table 12). */
const LEVEL_BITS = 0b01;
/** Conditions under which a mask inverts the module of a column and row (table 10). */
export const MASKS: readonly ((x: number, y: number) => boolean)[] = [
  (x, y) => (x + y) % 2 === 0,
  (_, y) => y % 2 === 0,
  (x) => x % 3 === 0,
  (x, y) => (x + y) % 3 === 0,
  (x, y) => (Math.floor(x / 3) + Math.floor(y / 2)) % 2 === 0,
  (x, y) => ((x * y) % 2) + ((x * y) % 3) === 0,
  (x, y) => (((x * y) % 2) + ((x * y) % 3)) % 2 === 0,
  (x, y) => (((x + y) % 2) + ((x * y) % 3)) % 2 === 0,
];

/** Return the code of a text, of the smallest version that holds it and with the mask of the least penalty; null if none holds it. */
export function makeQrCode(text: string): QrCode | null {
  const bytes = new TextEncoder().encode(text);
  for (let version = 1; version <= BLOCK_COUNTS.length; version++) {
    const matrix = new Matrix(version);
    const capacity = matrix.freeCount >> 3;
    const [blocks, correction] = [BLOCK_COUNTS[version - 1], CORRECTION_LENGTHS[version - 1]];
    const data = encodeBytes(bytes, version < 10 ? 1 : 2, capacity - blocks * correction);
    if (!data) continue;
    matrix.placeCodewords(interleave(data, capacity, blocks, correction));
    const masked = MASKS.map((_, mask) => matrix.withMask(mask));
    return masked.reduce((best, code) => (penaltyOf(code) < penaltyOf(best) ? code : best));
  }
  return null;
}

/** Return the data codewords: mode, length, bytes, terminator and padding; null if there are more than `capacity`. */
function encodeBytes(bytes: Uint8Array, lengthBytes: number, capacity: number): number[] | null {
  if (bytes.length + lengthBytes + 1 > capacity) return null;
  const length = lengthBytes === 1 ? [bytes.length] : [bytes.length >> 8, bytes.length & 255];
  // The mode, 0100, shifts all bytes by half a byte; the terminator fills the last one.
  const content = [...length, ...bytes];
  const data = [4, ...content].map((byte, i) => ((byte << 4) & 255) | ((content[i] ?? 0) >> 4));
  for (let pad = 0xec; data.length < capacity; pad ^= 0xec ^ 0x11) data.push(pad);
  return data;
}

/** Divide the data into blocks, append the error correction of each, and take the codewords of all blocks in turn. */
function interleave(data: readonly number[], capacity: number, blockCount: number, correction: number): number[] {
  const longBlocks = capacity % blockCount;
  const shortLength = Math.floor(capacity / blockCount) - correction;
  let at = 0;
  const blocks = Array.from({ length: blockCount }, (_, i) => {
    const begin = at;
    at += shortLength + Number(i >= blockCount - longBlocks);
    return data.slice(begin, at);
  });
  const corrections = blocks.map((block) => divide(block, correction));
  return [takeInTurn(blocks, shortLength + 1), takeInTurn(corrections, correction)].flat();
}

function takeInTurn(blocks: readonly (readonly number[])[], length: number): number[] {
  return Array.from({ length }, (_, i) => blocks.flatMap((block) => block[i] ?? [])).flat();
}

/** Multiply in GF(256) with the polynomial x^8 + x^4 + x^3 + x^2 + 1. */
export function multiply(a: number, b: number): number {
  let product = 0;
  for (let bit = 7; bit >= 0; bit--) product = (product << 1) ^ ((product >> 7) * 0x11d) ^ (((b >> bit) & 1) * a);
  return product;
}

/** Return the remainder of a block by the generator polynomial of `length` codewords: Reed-Solomon error correction. */
function divide(block: readonly number[], length: number): number[] {
  let generator = [1];
  for (let i = 0, root = 1; i < length; i++, root = multiply(root, 2))
    generator = [...generator, 0].map((value, k) => value ^ multiply(generator[k - 1] ?? 0, root));
  const remainder = new Array<number>(length).fill(0);
  for (const value of block) {
    const factor = value ^ (remainder.shift() as number);
    remainder.push(0);
    for (let k = 0; k < length; k++) remainder[k] ^= multiply(generator[k + 1], factor);
  }
  return remainder;
}

/** Return a value of `bits` bits with the remainder of its division by a generator polynomial appended (annexes C, D). */
function appendRemainder(value: number, generator: number): number {
  const degree = 31 - Math.clz32(generator);
  let remainder = value << degree;
  for (let bit = 31 - Math.clz32(remainder); bit >= degree; bit = 31 - Math.clz32(remainder))
    remainder ^= generator << (bit - degree);
  return (value << degree) | remainder;
}

/** Modules of a version: function patterns, and the codewords around them. */
class Matrix {
  readonly size: number;
  /** Number of modules for codewords. */
  readonly freeCount: number;
  readonly #dark: boolean[][];
  readonly #isFunction: boolean[][];

  constructor(version: number) {
    const size = 17 + 4 * version;
    this.size = size;
    const createModules = () => Array.from({ length: size }, () => Array<boolean>(size).fill(false));
    [this.#dark, this.#isFunction] = [createModules(), createModules()];
    for (let i = 0; i < size; i++)
      for (const [x, y] of [
        [6, i],
        [i, 6],
      ])
        this.#set(x, y, i % 2 === 0);
    for (const [x, y] of [
      [3, 3],
      [size - 4, 3],
      [3, size - 4],
    ])
      this.#drawSquares(x, y, 4);
    const centres = alignmentCentres(version, size);
    // All but those on the three finder patterns.
    for (const x of centres)
      for (const y of centres)
        if (Math.max(x, y) - Math.min(x, y) < size - 13 && x + y > 12) this.#drawSquares(x, y, 2);
    this.#drawFormat(this.#dark, 0);
    if (version >= 7) this.#drawVersion(appendRemainder(version, 0x1f25));
    this.freeCount = this.#isFunction.flat().filter((isFunction) => !isFunction).length;
  }

  /** Place the bits of codewords in columns of two modules, from the right, upwards first (7.7.3). */
  placeCodewords(codewords: readonly number[]): void {
    let bit = 0;
    for (const [x, y] of this.freeModules()) {
      this.#dark[y][x] = (((codewords[bit >> 3] ?? 0) >> (7 - (bit & 7))) & 1) === 1;
      bit++;
    }
  }

  /** Modules for codewords, in their order. */
  *freeModules(): Generator<readonly [x: number, y: number]> {
    let isUpwards = true;
    for (let right = this.size - 1; right > 0; right -= 2) {
      if (right === 6) right--;
      for (let i = 0; i < this.size; i++) {
        const y = isUpwards ? this.size - 1 - i : i;
        for (const x of [right, right - 1]) if (!this.#isFunction[y][x]) yield [x, y];
      }
      isUpwards = !isUpwards;
    }
  }

  /** Return the modules under a mask, with its format information. */
  withMask(mask: number): boolean[][] {
    const isInverted = MASKS[mask];
    const modules = this.#dark.map((row, y) =>
      row.map((dark, x) => dark !== (!this.#isFunction[y][x] && isInverted(x, y))),
    );
    this.#drawFormat(modules, mask);
    return modules;
  }

  #set(x: number, y: number, dark: boolean, modules = this.#dark): void {
    if (x < 0 || y < 0 || x >= this.size || y >= this.size) return;
    modules[y][x] = dark;
    this.#isFunction[y][x] = true;
  }

  /** Draw concentric squares: a finder pattern with its separator (radius 4), or an alignment pattern (radius 2). */
  #drawSquares(centreX: number, centreY: number, radius: number): void {
    for (let dy = -radius; dy <= radius; dy++)
      for (let dx = -radius; dx <= radius; dx++) {
        const distance = Math.max(Math.abs(dx), Math.abs(dy));
        this.#set(centreX + dx, centreY + dy, radius === 2 ? distance !== 1 : distance !== 2 && distance !== 4);
      }
  }

  /** Draw both copies of the format information, and the dark module (7.9). */
  #drawFormat(modules: boolean[][], mask: number): void {
    const { size } = this;
    const bits = appendRemainder((LEVEL_BITS << 3) | mask, 0x537) ^ 0x5412;
    for (let i = 0; i < 15; i++) {
      const dark = ((bits >> i) & 1) === 1;
      if (i < 8) this.#set(8, i < 6 ? i : i + 1, dark, modules);
      else this.#set(i === 8 ? 7 : 14 - i, 8, dark, modules);
      if (i < 8) this.#set(size - 1 - i, 8, dark, modules);
      else this.#set(8, size - 15 + i, dark, modules);
    }
    this.#set(8, size - 8, true, modules);
  }

  /** Draw both copies of the version information (7.10). */
  #drawVersion(bits: number): void {
    for (let i = 0; i < 18; i++) {
      const [a, b, dark] = [this.size - 11 + (i % 3), Math.floor(i / 3), ((bits >> i) & 1) === 1];
      this.#set(a, b, dark);
      this.#set(b, a, dark);
    }
  }
}

/** Return the coordinates of the centres of alignment patterns (annex E): 6, and equal steps up to the far edge. */
function alignmentCentres(version: number, size: number): number[] {
  if (version === 1) return [];
  const gaps = Math.floor(version / 7) + 1;
  const step = 2 * Math.ceil((size - 13) / gaps / 2);
  return [6, ...Array.from({ length: gaps }, (_, i) => size - 7 - (gaps - 1 - i) * step)];
}

/** Return the penalty of a code (7.8.3): runs, blocks, shapes of finder patterns, and unequal shares. */
function penaltyOf(code: QrCode): number {
  const columns = code.map((_, x) => code.map((row) => row[x]));
  let penalty = 0;
  for (const line of [...code, ...columns]) {
    const text = line.map(Number).join("");
    for (const [run] of text.matchAll(/0{5,}|1{5,}/g)) penalty += run.length - 2;
    for (const shape of ["10111010000", "00001011101"])
      for (let at = text.indexOf(shape); at >= 0; at = text.indexOf(shape, at + 1)) penalty += 40;
  }
  let dark = 0;
  code.forEach((row, y) =>
    row.forEach((module, x) => {
      dark += Number(module);
      const isBlock =
        x > 0 && y > 0 && row[x - 1] === module && code[y - 1][x] === module && code[y - 1][x - 1] === module;
      if (isBlock) penalty += 3;
    }),
  );
  return penalty + 10 * Math.floor(Math.abs((20 * dark) / code.length ** 2 - 10));
}
