/** The person before the camera is a live performer on the stage. */
import { Performer } from "../client/performer";
import { ProblemError } from "../client/problem";
import { translate } from "../i18n/translator";
import type { WebcamProblem } from "../ui/webcam/webcam-card";
import type { CameraFrame } from "../webcam/body-camera";
import { BODY_FIGURE } from "../webcam/body-figure";
import { BodyTracker, type TrackedBody } from "../webcam/body-tracker";
import { type CameraMode, type CameraState, NO_ACTIVE_HANDS } from "./webcam-mode";

/** Pictures that a camera takes per second. Slow machines detect the body in fewer of them. */
const CAMERA_FPS = 30;
/** Both hands are seen as part of the body. */
const BOTH_HANDS: CameraState["activeHands"] = { left: true, right: true };

export interface PerformerModeOptions {
  readonly session: string;
  readonly name: string;
  /** The performance could not begin, or was ended elsewhere. */
  onProblem(problem: WebcamProblem): void;
  /** The performance has ended, and its motion comes into the library. */
  onEnded(motion: string): void;
}

export class PerformerMode implements CameraMode {
  readonly #tracker = new BodyTracker();
  /** The performance from its first pose to its end. */
  #performance: Promise<Performer> | null = null;
  #performer: Performer | null = null;

  constructor(private readonly options: PerformerModeOptions) {}

  follow({ body, aspect, now }: CameraFrame): CameraState {
    const tracked = this.#tracker.update(body, aspect, now / 1000);
    const { phase, progress, pose } = tracked;
    if (pose) {
      this.#performance ??= this.#begin();
      this.#performer?.frame(pose.root, pose.rotations, now);
    }
    return { phase, progress, status: this.#statusOf(tracked), activeHands: pose ? BOTH_HANDS : NO_ACTIVE_HANDS };
  }

  recalibrate(): void {
    this.#tracker.recalibrate();
  }

  pause(): void {
    // Without poses the server holds the last one, then fades to rest.
  }

  close(): void {
    const performance = this.#performance;
    this.#performance = this.#performer = null;
    performance
      ?.then(async (performer) => {
        await performer.close();
        this.options.onEnded(performer.motion);
      })
      // The server, which cannot be reached, ends the performance by itself; one that did not begin was reported.
      .catch(() => undefined);
  }

  /** Bring the performer on the stage. Reports why that fails. */
  #begin(): Promise<Performer> {
    const { session, name } = this.options;
    const performance = Performer.open({ session, name, fps: CAMERA_FPS, figure: BODY_FIGURE });
    const ifCurrent = (handle: () => void) => performance === this.#performance && handle();
    performance.then(
      (performer) =>
        ifCurrent(() => {
          this.#performer = performer;
          performer.addEventListener("ended", () =>
            ifCurrent(() =>
              this.#fail({
                cause: translate("Your performance has ended"),
                remedy: translate("It was ended elsewhere, or the connection was lost for long. Try again to go on."),
              }),
            ),
          );
        }),
      (error: unknown) => ifCurrent(() => this.#fail(describeFailure(error))),
    );
    return performance;
  }

  #fail(problem: WebcamProblem): void {
    this.#performance = this.#performer = null;
    this.options.onProblem(problem);
  }

  #statusOf({ phase, hasFeet }: TrackedBody): CameraState["status"] {
    if (phase === "searching") return "Bring your head and shoulders into the picture";
    if (phase === "calibrating") return "Keep still for a moment";
    if (!this.#performer) return "You are being brought on the stage";
    if (!this.#performer.isOpen) return "The connection was lost, and is tried again";
    return hasFeet
      ? "You are live on the stage"
      : "You are live on the stage. Step back until your feet are in the picture to move your legs too";
  }
}

function describeFailure(error: unknown): WebcamProblem {
  if (!(error instanceof ProblemError))
    return {
      cause: translate("You could not be brought on the stage"),
      remedy: translate("Check your connection, then try again."),
    };
  const { title, detail, hint } = error;
  return { cause: title, remedy: hint === null ? detail : `${detail}. ${hint}` };
}
