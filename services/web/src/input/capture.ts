/** Hears which control of a gamepad somebody means: one alone, or one with a button held. Pure. */
import { HALF_WAY } from "./gamepad-reading";
import type { Control } from "./mapping";

export class PadCapture {
  #rested = false;
  #first: Control | null = null;

  /** Given all that is pressed (0 to 1) once a frame: the control meant, once that is clear. What was down before the first rest does not count. */
  see(pressed: ReadonlyMap<Control, number>): Control | null {
    const down = [...pressed].filter(([, strength]) => strength > HALF_WAY).map(([control]) => control);
    if (!this.#rested) {
      this.#rested = down.length === 0;
      return null;
    }
    const first = this.#first ?? down.find((control) => control.startsWith("button")) ?? null;
    const other = down.find((control) => control !== first);
    if (first === null) return other ?? null;
    if (other !== undefined) return `${first} ${other}`;
    this.#first = first;
    // a button alone is meant when it comes up alone
    return down.length === 0 ? first : null;
  }
}
