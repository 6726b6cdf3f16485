/** Which of several performers this page's keys, pad and buttons act on. */
import { limbNumber } from "../wire/limbs";

export class PerformerSelection {
  #performer = 0;
  #count = 1;

  /** `changed` is told of another choice, and of another number of performers. */
  constructor(private readonly onChange: () => void = () => undefined) {}

  get performer(): number {
    return this.#performer;
  }

  /** How many performers there are to choose from, one at least. */
  get count(): number {
    return this.#count;
  }

  set count(count: number) {
    if (count === this.#count) return;
    this.#count = count;
    if (this.#performer >= count) this.#performer = 0;
    this.onChange();
  }

  select(performer: number): void {
    if (performer === this.#performer || performer >= this.#count) return;
    this.#performer = performer;
    this.onChange();
  }

  /** The number of the chosen performer's limb; `part` counts as `LIMBS`. Here, and nowhere else, do keys and pad come to know whose limb they mean. */
  limb(part: number): number {
    return limbNumber(this.#performer, part);
  }
}
