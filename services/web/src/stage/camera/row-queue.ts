/** A queue of rows of numbers in one piece of memory, the oldest first: each as an array of its own would take several times as much. */

/** Rows that there is room for at first; there is twice as much whenever that is full. */
const INITIAL_CAPACITY = 64;

export class RowQueue {
  #numbers: Float64Array;
  #first = 0;
  #length = 0;

  /** Of `width` numbers each. */
  constructor(readonly width: number) {
    this.#numbers = new Float64Array(INITIAL_CAPACITY * width);
  }

  get length(): number {
    return this.#length;
  }

  /** The row at `index`, from the end where that is below zero; null where there is none. It is the live array, until the next `push`. */
  at(index: number): Float64Array | null {
    const { width } = this;
    const nth = index < 0 ? this.#length + index : index;
    if (nth < 0 || nth >= this.#length) return null;
    const begin = (this.#first + nth) * width;
    return this.#numbers.subarray(begin, begin + width);
  }

  /** How many of the first rows begin with a number of at most `most`; these ascend. */
  countUpTo(max: number): number {
    let [low, high] = [0, this.#length];
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.#numbers[(this.#first + middle) * this.width] <= max) low = middle + 1;
      else high = middle;
    }
    return low;
  }

  /** A copy of `row` is the last one from now on. */
  push(row: ArrayLike<number>): void {
    const { width } = this;
    if ((this.#first + this.#length + 1) * width > this.#numbers.length) this.#reserve();
    this.#numbers.set(row, (this.#first + this.#length) * width);
    this.#length++;
  }

  /** Forgets the first `count`. */
  drop(count: number): void {
    const gone = Math.min(count, this.#length);
    this.#first += gone;
    this.#length -= gone;
  }

  /** Forgets all, and gives the memory back. */
  clear(): void {
    this.#numbers = new Float64Array(INITIAL_CAPACITY * this.width);
    this.#first = this.#length = 0;
  }

  /** Moves the rows to the beginning: of the same memory where at least half of it is free, else of twice as much. */
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
