/** Hands of a person from the landmarks of successive pictures: smoothed, and as far as they are seen. Pure. */
import type { BodyMessage, HandReach, HandState } from "../input/body-input";
import { OneEuro } from "../input/one-euro";
import type { Side } from "./body-view";
import { handReach } from "./hand-reach";
import type { DetectedBody } from "./landmark";
import { type Person, PersonTracker, type Tracking } from "./person-tracker";
import { VisibilityGate } from "./visibility-gate";

export interface TrackedHands extends Tracking {
  readonly hands: BodyMessage;
}

/** Smoothing of the hands, in arm lengths per second: little lag when they are fast. */
const SMOOTHING = { minCutoff: 1.2, beta: 3, derivativeCutoff: 1 };

export const NO_HANDS: BodyMessage = { left: null, right: null };

class HandFilter {
  readonly gate = new VisibilityGate();
  readonly filter = new OneEuro(3, SMOOTHING);
}

export class HandTracker {
  readonly #person = new PersonTracker();
  readonly #hands: Readonly<Record<Side, HandFilter>> = { left: new HandFilter(), right: new HandFilter() };

  /** Calibrate again. */
  recalibrate(): void {
    this.#person.recalibrate();
  }

  /** Follow the person in a picture: see `PersonTracker.update`. */
  update(body: DetectedBody | null, aspect: number, seconds: number): TrackedHands {
    const { person, ...tracking } = this.#person.update(body, aspect, seconds);
    if (person === null) return { ...tracking, hands: NO_HANDS };
    const find = (side: Side) => this.#findHand(side, person, seconds);
    return { ...tracking, hands: { left: find("left"), right: find("right") } };
  }

  #findHand(side: Side, { view, stature, scale }: Person, seconds: number): HandState {
    const { gate, filter } = this.#hands[side];
    const sight = gate.update(view?.[side].wristVisibility ?? 0, seconds);
    if (sight === "lost") filter.reset();
    if (sight !== "seen" || !view) return sight === "lost" ? null : "hold";
    const reach = handReach(view[side], side, scale, stature.armLength);
    return [...filter.filter(reach, seconds)] as unknown as HandReach;
  }
}
