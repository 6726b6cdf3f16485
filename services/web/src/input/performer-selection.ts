/** Selection of the performer that this page's keys, gamepad and buttons act on. */
import { limbNumber } from "../wire/limbs";

export class PerformerSelection {
  #performer = 0;
  #count = 1;

  /** `onChange` is called when the selection or the number of performers changes. */
  constructor(private readonly onChange: () => void = () => undefined) {}

  get performer(): number {
    return this.#performer;
  }

  /** Number of performers, at least one. */
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

  /**
   * Return the number of a limb of the selected performer; `part` indexes `LIMBS`. Only here do keys and gamepad learn
   * which performer they control.
   */
  limb(part: number): number {
    return limbNumber(this.#performer, part);
  }
}
