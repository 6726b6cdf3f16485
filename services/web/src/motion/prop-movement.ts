/** Movement of a prop that is taken, passed or laid down: it goes to its new place within a short time. Pure. */
import { createPropTransform, type PropTransform } from "./props";
import { slerp } from "./rotation";
import { combine } from "./vector";

/** Time in which a prop moves to another place, in seconds. */
const DURATION_S = 0.25;

export class PropMovement {
  /** Transform of the last call of `moveTo`. */
  readonly transform = createPropTransform();
  readonly #start = createPropTransform();
  /** Hand or place of the last call; null before the first and while the prop is not seen. */
  #state: string | null = null;
  /** Share of the movement that is left. */
  #left = 0;

  /**
   * Move towards a transform, which is that of a prop in the hand `limb`, or else at this place of the floor, and may
   * itself move. Return where the prop is `seconds` after the last call. Infinity moves it at once, as does the first
   * call.
   */
  moveTo(
    target: PropTransform,
    { limb, place }: { readonly limb: number | null; readonly place: readonly number[] },
    seconds: number,
  ): PropTransform {
    const { position, rotation } = this.transform;
    const state = limb === null ? place.join() : `limb ${limb}`;
    if (this.#state !== null && state !== this.#state) {
      this.#start.position.set(position);
      this.#start.rotation.set(rotation);
      this.#left = 1;
    }
    this.#state = state;
    this.#left = Math.max(this.#left - seconds / DURATION_S, 0);
    const left = this.#left * this.#left * (3 - 2 * this.#left);
    combine(position, 0, target.position, 0, 1 - left, this.#start.position, 0, left);
    slerp(rotation, 0, target.rotation, 0, this.#start.rotation, 0, left);
    return this.transform;
  }

  /** Forget where the prop was: it is not seen. */
  hide(): void {
    this.#state = null;
    this.#left = 0;
  }
}
