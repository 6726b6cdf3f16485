/**
 * Decision whether a hand is seen. It takes a hand only after it was clearly seen for a moment, and lets go of it only
 * after it was gone for longer: meanwhile the hand is held where it was. Pure.
 */

export type Sight = "seen" | "held" | "lost";

/** Visibility with which a hand is taken, and with which it is kept. */
export const [TAKE_VISIBILITY, KEEP_VISIBILITY] = [0.6, 0.35];
/** Time for which a hand must be seen before it is taken, and for which it is held unseen, in seconds. */
export const [TAKE_S, HOLD_S] = [0.15, 1];

export class VisibilityGate {
  #isTaken = false;
  /** Time since which the hand has been seen without interruption, and at which it was seen last. */
  #seenSince: number | null = null;
  #seenAt = -Infinity;

  /** Return how a hand with this visibility is regarded. Times never decrease. */
  update(visibility: number, seconds: number): Sight {
    if (visibility >= (this.#isTaken ? KEEP_VISIBILITY : TAKE_VISIBILITY)) {
      this.#seenSince ??= seconds;
      this.#seenAt = seconds;
      this.#isTaken ||= seconds - this.#seenSince >= TAKE_S;
      return this.#isTaken ? "seen" : "lost";
    }
    this.#seenSince = null;
    this.#isTaken &&= seconds - this.#seenAt <= HOLD_S;
    return this.#isTaken ? "held" : "lost";
  }
}
