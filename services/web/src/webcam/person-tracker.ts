/**
 * The person in successive pictures: found by the shoulders, calibrated while standing still, and measured in every
 * picture. Pure.
 */
import { type BodyView, SIDES, viewBody } from "./body-view";
import { Calibration, type Stature } from "./calibration";
import type { DetectedBody } from "./landmark";

/** `searching`: no person is seen; `calibrating`: the person is to stand still; `following`: the person is followed. */
export type TrackingPhase = "searching" | "calibrating" | "following";

export interface Tracking {
  readonly phase: TrackingPhase;
  /** Progress of the calibration, 0 to 1. */
  readonly progress: number;
}

/** A person as calibrated. */
export interface Person {
  readonly stature: Stature;
  /** The present picture; null if it does not show the person. */
  readonly view: BodyView | null;
  /** Size in the picture, smoothed: `BodyView.scale`. */
  readonly scale: number;
}

export interface TrackedPerson extends Tracking {
  /** Null until the person has stood still. */
  readonly person: Person | null;
}

/** Time constant of the smoothing of the person's size in the picture, in seconds. */
const SCALE_TIME_S = 0.8;
/** The same while the shoulders become narrower, as they do whenever the arms are raised. */
const NARROWING_TIME_S = 8;
/** Time without a person after which another may have come, so that it is calibrated again, in seconds. */
export const FORGET_S = 10;
const MIN_SHOULDER_VISIBILITY = 0.5;

export class PersonTracker {
  readonly #calibration = new Calibration();
  #scale: { value: number; seconds: number } | null = null;
  #seenAt = -Infinity;

  /** Calibrate again. */
  recalibrate(): void {
    this.#calibration.reset();
    this.#scale = null;
  }

  /**
   * Follow the person in a picture whose width is `aspect` heights; `body` is null if it shows nobody. Times never
   * decrease.
   */
  update(body: DetectedBody | null, aspect: number, seconds: number): TrackedPerson {
    const view = body && viewBody(body, aspect);
    const isSeen = view !== null && SIDES.some((side) => view[side].shoulderVisibility >= MIN_SHOULDER_VISIBILITY);
    if (isSeen) this.#seenAt = seconds;
    else if (seconds - this.#seenAt > FORGET_S) this.recalibrate();
    this.#calibration.add(view, seconds);
    const { stature, progress } = this.#calibration;
    if (stature === null) return { phase: isSeen ? "calibrating" : "searching", progress, person: null };
    if (view && isSeen) this.#followScale(view, stature, seconds);
    const person = { stature, view: isSeen ? view : null, scale: this.#scale?.value ?? stature.scale };
    return { phase: isSeen ? "following" : "searching", progress, person };
  }

  /** Follow the person's size in the picture: by the trunk, whose length the arms do not change, else the shoulders. */
  #followScale(view: BodyView, stature: Stature, seconds: number): void {
    const growth = view.trunk !== null && stature.trunk !== null ? view.trunk / stature.trunk : null;
    const value = growth === null ? view.scale : stature.scale * growth;
    const before = this.#scale ?? { value: stature.scale, seconds };
    const time = growth !== null || value > before.value ? SCALE_TIME_S : NARROWING_TIME_S;
    const share = 1 - Math.exp(-(seconds - before.seconds) / time);
    this.#scale = { value: before.value + (value - before.value) * share, seconds };
  }
}
