/** Samples of a quantity over time. */

/** Newest `length` samples of a quantity; NaN marks a gap. */
export class SampleHistory {
  readonly values: number[] = [];
  readonly #capacity: number;

  constructor(length: number) {
    this.#capacity = length;
  }

  push(value: number): void {
    this.values.push(value);
    if (this.values.length > this.#capacity) this.values.shift();
  }
}
