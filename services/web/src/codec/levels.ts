/** Sizes on a logarithmic scale, in integers so that every decoder reaches the same (`proto/SPEC.md`, Levels). */

const MOST = 4096;
const table = new Uint8Array(MOST);
let filled = false;

/** Half the bits of (size + 1)^32, rounded down. */
function define(size: number): number {
  const digits = (BigInt(size + 1) ** 32n).toString(16);
  return (4 * digits.length - Math.clz32(Number.parseInt(digits[0], 16)) + 28) >> 1;
}

/** Fills the table from `first` to `last`, whose levels are known: few sizes need the definition, as it never falls. */
function fill(first: number, last: number, lowest: number, highest: number): void {
  if (lowest === highest || last - first < 2) {
    table.fill(lowest, first, last);
    table[last] = highest;
    return;
  }
  const middle = (first + last) >> 1, between = define(middle);
  fill(first, middle, lowest, between);
  fill(middle, last, between, highest);
}

/** Levels of 0..4095; larger sizes have that of 4095. */
export function levels(): Uint8Array {
  if (!filled) fill(0, MOST - 1, define(0), define(MOST - 1));
  filled = true;
  return table;
}

/** 16 log2(1 + size), rounded. */
export function level(size: number): number {
  return levels()[Math.min(size, MOST - 1)];
}
