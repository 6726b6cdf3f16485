/** Pinches of a tracked hand: thumb and index finger hold a string, thumb and middle finger are a gesture. Pure. */
import type { Vector3 } from "three";
import type { ImmersiveAction } from "./controller";
import { Threshold } from "./threshold";

/** Tips of the fingers that matter, in the same frame, in metres. */
export interface FingerTips {
  readonly thumb: Vector3;
  readonly index: Vector3;
  readonly middle: Vector3;
}

/** Distances of two tips at which a pinch begins and ends, in metres. */
const PINCH_M = 0.02;
const OPEN_M = 0.035;

export class Pinch {
  readonly #index = new Threshold(-PINCH_M, -OPEN_M);
  readonly #middle = new Threshold(-PINCH_M, -OPEN_M);
  /** True if the index finger was part of the present pinch: it was meant to hold, whatever other fingers touch. */
  #hasHeld = false;

  /** True while thumb and index finger pinch. */
  get isClosed(): boolean {
    return this.#index.isOn;
  }

  /** Read the hand, once per frame. Return the actions that begin now. */
  update({ thumb, index, middle }: FingerTips): ImmersiveAction[] {
    this.#index.update(-thumb.distanceTo(index));
    const isGesture = this.#middle.update(-thumb.distanceTo(middle));
    if (this.#index.isOn) this.#hasHeld = true;
    else if (!this.#middle.isOn) this.#hasHeld = false;
    return isGesture && !this.#hasHeld ? ["next performer"] : [];
  }
}
