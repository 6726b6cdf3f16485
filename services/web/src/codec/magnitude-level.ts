/** Levels of magnitudes: a logarithmic scale in integers, so that all decoders agree (`proto/codec.md`, 2.10). */

const LEVEL_COUNT = 4096;
const table = new Uint8Array(LEVEL_COUNT);
let isFilled = false;

/** Half the bits of (magnitude + 1)^32, rounded down. */
function computeLevel(magnitude: number): number {
  const digits = (BigInt(magnitude + 1) ** 32n).toString(16);
  return (4 * digits.length - Math.clz32(Number.parseInt(digits[0], 16)) + 28) >> 1;
}

/** Fills the table between two known levels. Levels never decrease, so few magnitudes need the definition. */
function fillTable(first: number, last: number, lowest: number, highest: number): void {
  if (lowest === highest || last - first < 2) {
    table.fill(lowest, first, last);
    table[last] = highest;
    return;
  }
  const middle = (first + last) >> 1,
    between = computeLevel(middle);
  fillTable(first, middle, lowest, between);
  fillTable(middle, last, between, highest);
}

/** Levels of the magnitudes 0..4095; larger ones have the level of 4095. */
export function magnitudeLevels(): Uint8Array {
  if (!isFilled) fillTable(0, LEVEL_COUNT - 1, computeLevel(0), computeLevel(LEVEL_COUNT - 1));
  isFilled = true;
  return table;
}

/** Returns 16 log2(1 + magnitude), rounded. */
export function magnitudeLevel(magnitude: number): number {
  return magnitudeLevels()[Math.min(magnitude, LEVEL_COUNT - 1)];
}
