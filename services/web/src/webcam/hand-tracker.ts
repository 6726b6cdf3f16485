/**
 * Hands of a person from the landmarks of successive pictures: finds the shoulders, calibrates while the person stands
 * still, then follows both hands, smoothed and as far as they are seen. Pure.
 */
import type { BodyMessage, HandReach, HandState } from "../input/body-input";
import { OneEuro } from "../input/one-euro";
import { type BodyView, SIDES, type Side, viewBody } from "./body-view";
import { Calibration, type Stature } from "./calibration";
import { handReach } from "./hand-reach";
import type { DetectedBody } from "./landmark";
import { VisibilityGate } from "./visibility-gate";

/** `searching`: no person is seen; `calibrating`: the person is to stand still; `following`: the hands are followed. */
export type TrackingPhase = "searching" | "calibrating" | "following";

export interface TrackedHands {
  readonly phase: TrackingPhase;
  /** Progress of the calibration, 0 to 1. */
  readonly progress: number;
  readonly hands: BodyMessage;
}

/** Smoothing of the hands, in arm lengths per second: little lag when they are fast. */
const SMOOTHING = { minCutoff: 1.2, beta: 3, derivativeCutoff: 1 };
/** Time constant of the smoothing of the person's size in the picture, in seconds. */
const SCALE_TIME_S = 0.8;
/** The same while the shoulders become narrower, as they do whenever the arms are raised. */
const NARROWING_TIME_S = 8;
/** Time without a person after which another may have come, so that it is calibrated again, in seconds. */
export const FORGET_S = 10;
const MIN_SHOULDER_VISIBILITY = 0.5;

const NO_HANDS: BodyMessage = { left: null, right: null };

class HandFilter {
  readonly gate = new VisibilityGate();
  readonly filter = new OneEuro(3, SMOOTHING);
}

export class HandTracker {
  readonly #calibration = new Calibration();
  readonly #hands: Readonly<Record<Side, HandFilter>> = { left: new HandFilter(), right: new HandFilter() };
  #scale: { value: number; seconds: number } | null = null;
  #seenAt = -Infinity;

  /** Calibrate again. */
  recalibrate(): void {
    this.#calibration.reset();
    this.#scale = null;
  }

  /**
   * Follow the hands in a picture whose width is `aspect` heights; `body` is null if it shows no person. Times never
   * decrease.
   */
  update(body: DetectedBody | null, aspect: number, seconds: number): TrackedHands {
    const view = body && viewBody(body, aspect);
    const isSeen = view !== null && SIDES.some((side) => view[side].shoulderVisibility >= MIN_SHOULDER_VISIBILITY);
    if (isSeen) this.#seenAt = seconds;
    else if (seconds - this.#seenAt > FORGET_S) this.recalibrate();
    this.#calibration.add(view, seconds);
    const { stature, progress } = this.#calibration;
    if (stature === null) return { phase: isSeen ? "calibrating" : "searching", progress, hands: NO_HANDS };
    if (view && isSeen) this.#followScale(view, stature, seconds);
    const find = (side: Side) => this.#findHand(side, isSeen ? view : null, stature.armLength, seconds);
    return { phase: isSeen ? "following" : "searching", progress, hands: { left: find("left"), right: find("right") } };
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

  #findHand(side: Side, view: BodyView | null, armLength: number, seconds: number): HandState {
    const { gate, filter } = this.#hands[side];
    const sight = gate.update(view?.[side].wristVisibility ?? 0, seconds);
    if (sight === "lost") filter.reset();
    if (sight !== "seen" || !view || !this.#scale) return sight === "lost" ? null : "hold";
    const reach = handReach(view[side], side, this.#scale.value, armLength);
    return [...filter.filter(reach, seconds)] as unknown as HandReach;
  }
}
