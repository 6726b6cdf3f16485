/** Queue of rows of numbers in one array: an array per row would take several times the memory. */

/** Rows allocated at first; the capacity doubles when it is exceeded. */
const INITIAL_CAPACITY = 64;

export class RowQueue {
  #numbers: Float64Array;
  #first = 0;
  #length = 0;

  /** Create a queue of rows with `width` numbers each. */
  constructor(readonly width: number) {
    this.#numbers = new Float64Array(INITIAL_CAPACITY * width);
  }

  get length(): number {
    return this.#length;
  }

  /**
   * Return the row at `index` (counted from the end if negative), or null. The array is valid until the next `push`.
   */
  at(index: number): Float64Array | null {
    const { width } = this;
    const row = index < 0 ? this.#length + index : index;
    if (row < 0 || row >= this.#length) return null;
    const begin = (this.#first + row) * width;
    return this.#numbers.subarray(begin, begin + width);
  }

  /** Return how many leading rows have a first number of at most `max`; first numbers ascend. */
  countUpTo(max: number): number {
    let [low, high] = [0, this.#length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.#numbers[(this.#first + middle) * this.width] <= max) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  /** Append a copy of `row`. */
  push(row: ArrayLike<number>): void {
    const { width } = this;
    if ((this.#first + this.#length + 1) * width > this.#numbers.length) this.#reserve();
    this.#numbers.set(row, (this.#first + this.#length) * width);
    this.#length++;
  }

  /** Remove the first `count` rows. */
  drop(count: number): void {
    const removed = Math.min(count, this.#length);
    this.#first += removed;
    this.#length -= removed;
  }

  /** Remove all rows and release the memory. */
  clear(): void {
    this.#numbers = new Float64Array(INITIAL_CAPACITY * this.width);
    this.#first = this.#length = 0;
  }

  /** Move the rows to the start of the same array if at least half of it is free, else of one twice as large. */
  #reserve(): void {
    const { width } = this;
    const begin = this.#first * width;
    const end = begin + this.#length * width;
    if (this.#length * 2 * width <= this.#numbers.length) {
      this.#numbers.copyWithin(0, begin, end);
    } else {
      const more = new Float64Array(this.#numbers.length * 2);
      more.set(this.#numbers.subarray(begin, end));
      this.#numbers = more;
    }
    this.#first = 0;
  }
}
