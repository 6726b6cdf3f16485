/** The hands before the camera move the hands of the selected performer, as in a mirror. */
import type { BodyMessage, HandState } from "../input/body-input";
import type { CameraFrame } from "../webcam/body-camera";
import { HandTracker, NO_HANDS, type TrackedHands } from "../webcam/hand-tracker";
import type { CameraMode, CameraState } from "./webcam-mode";

export class HandsMode implements CameraMode {
  readonly #tracker = new HandTracker();

  /** `move` moves the hands; `now` is the time of the picture in milliseconds. */
  constructor(private readonly move: (hands: BodyMessage, now: number) => void) {}

  follow({ body, aspect, now }: CameraFrame): CameraState {
    const tracked = this.#tracker.update(body, aspect, now / 1000);
    const { hands, phase, progress } = tracked;
    this.move(hands, now);
    const activeHands = { left: isActive(hands.left), right: isActive(hands.right) };
    return { phase, progress, status: statusOf(tracked), activeHands };
  }

  recalibrate(): void {
    this.#tracker.recalibrate();
  }

  pause(): void {
    this.move(NO_HANDS, performance.now());
  }

  close(): void {
    this.pause();
  }
}

function isActive(hand: HandState): boolean {
  return hand !== null && hand !== "hold";
}

function statusOf({ phase, hands }: TrackedHands): CameraState["status"] {
  if (phase === "searching") return "Bring your head and shoulders into the picture";
  if (phase === "calibrating") return "Keep still for a moment";
  return hands.left === null && hands.right === null
    ? "Raise your hands into the picture"
    : "Your hands move the hands on the stage";
}
