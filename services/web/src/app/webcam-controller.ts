/** The person before the camera on the stage: camera, detector, mode and card. Loaded when the person asks for it. */

import { formatPercent } from "../i18n/number-format";
import { type PlainMessageKey, translate } from "../i18n/translator";
import { createWebcamCard, type ModeName, type WebcamCard, type WebcamProblem } from "../ui/webcam/webcam-card";
import { BodyCamera, type CameraFrame, ModelError } from "../webcam/body-camera";
import { CameraError, type CameraFailure, type CameraSource } from "../webcam/camera";
import type { LimbControls } from "./limb-controls";
import { HandsMode } from "./webcam-hands";
import { type CameraMode, NO_ACTIVE_HANDS } from "./webcam-mode";
import { PerformerMode } from "./webcam-performer";

/** Time in the background after which the camera is switched off, in milliseconds. */
export const HIDDEN_TIMEOUT_MS = 30_000;

const CAMERA_PROBLEMS: Readonly<Record<CameraFailure, readonly [cause: PlainMessageKey, remedy: PlainMessageKey]>> = {
  denied: [
    "The browser may not use the camera",
    "Allow the camera for this page, at the symbol beside the address, then try again.",
  ],
  missing: ["There is no camera", "Connect a camera, then try again."],
  busy: ["The camera is in use", "Close the other program or page that uses it, then try again."],
  failed: ["The camera has stopped", "Check that it is connected, then try again."],
};
const MODEL_PROBLEM = [
  "You cannot be detected here",
  "The detector could not be loaded or run. Check your connection, then try again, or use another browser.",
] as const;

interface WebcamOptions {
  readonly root: HTMLElement;
  readonly source: CameraSource;
  /** What the person may do on the stage, the default first. */
  readonly modes: readonly ModeName[];
  createMode(name: ModeName, onProblem: (problem: WebcamProblem) => void): CameraMode;
  /** The camera was stopped. */
  onStop(): void;
  toast(message: string): void;
}

/** What the camera of a page can do on its stage. */
export interface WebcamStage {
  moveBody: LimbControls["moveBody"];
  /** Session on which the person may perform; null if this page may not bring a performer on its stage. */
  readonly session: string | null;
  readonly displayName: string;
  toast(message: string): void;
  /** A performance has ended, and its motion comes into the library. */
  onPerformed(motion: string): void;
}

/** The camera of the page while it is on. */
let current: WebcamController | null = null;

/** Switch the camera of the page on, or off. `onChange` is told whether it is on. */
export function toggleWebcam(stage: WebcamStage, onChange: (isOn: boolean) => void): void {
  if (current) {
    current.stop();
    return;
  }
  onChange(true);
  const { session, displayName: name, toast } = stage;
  current = new WebcamController({
    root: document.body,
    source: navigator.mediaDevices,
    modes: session === null ? ["hands"] : ["hands", "performer"],
    createMode: (mode, onProblem) =>
      mode === "performer" && session !== null
        ? new PerformerMode({ session, name, onProblem, onEnded: (motion) => stage.onPerformed(motion) })
        : new HandsMode((hands, now) => stage.moveBody(hands, now)),
    onStop: () => {
      current = null;
      onChange(false);
    },
    toast,
  });
}

class WebcamController {
  readonly #card: WebcamCard;
  #mode: CameraMode;
  #camera: BodyCamera | null = null;
  #hiddenTimer: ReturnType<typeof setTimeout> | undefined;
  #wasHidden = false;
  readonly #onVisibilityChange = () => this.#followVisibility();

  constructor(private readonly options: WebcamOptions) {
    this.#card = createWebcamCard(options.root, options.modes, {
      stop: () => this.stop(),
      recalibrate: () => this.#mode.recalibrate(),
      retry: () => this.#start(),
      choose: (mode) => this.#changeMode(mode),
    });
    this.#mode = this.#createMode(options.modes[0]);
    document.addEventListener("visibilitychange", this.#onVisibilityChange);
    this.#start();
  }

  /** Switch the camera off, leave the stage and remove the card. */
  stop(): void {
    this.#closeCamera();
    this.#mode.close();
    clearTimeout(this.#hiddenTimer);
    document.removeEventListener("visibilitychange", this.#onVisibilityChange);
    this.#card.remove();
    this.options.onStop();
  }

  #createMode(name: ModeName): CameraMode {
    return this.options.createMode(name, (problem) => {
      this.#closeCamera();
      this.#showProblem(problem);
    });
  }

  #changeMode(name: ModeName): void {
    this.#mode.close();
    this.#mode = this.#createMode(name);
    if (!this.#camera) this.#start();
  }

  #start(): void {
    const card = this.#card;
    card.setProblem(null);
    card.setStatus(translate("Allow the camera in your browser. Its picture never leaves this page."));
    this.#camera = new BodyCamera({
      source: this.options.source,
      onOpen: (video) => {
        this.#showProgress(0);
        video.addEventListener("loadeddata", () =>
          card.mirror.draw({ video, body: null, activeHands: NO_ACTIVE_HANDS }),
        );
      },
      onProgress: (share) => this.#showProgress(share),
      onFrame: (frame) => this.#onFrame(frame),
      onError: (error) => this.#onError(error),
    });
  }

  #showProgress(share: number): void {
    this.#card.setStatus(translate("Loading the detector: {share}", { share: formatPercent(share) }));
    this.#card.setProgress(share);
  }

  #onFrame(frame: CameraFrame): void {
    // A picture from before the page was hidden.
    if (document.hidden) return;
    const { phase, progress, status, activeHands } = this.#mode.follow(frame);
    this.#card.mirror.draw({ ...frame, activeHands });
    this.#card.setFollowing(phase === "following");
    this.#card.setStatus(translate(status));
    this.#card.setProgress(phase === "calibrating" ? progress : null);
  }

  #onError(error: unknown): void {
    this.#closeCamera();
    if (!(error instanceof CameraError) && !(error instanceof ModelError)) reportError(error);
    const [cause, remedy] =
      error instanceof ModelError
        ? MODEL_PROBLEM
        : CAMERA_PROBLEMS[error instanceof CameraError ? error.failure : "failed"];
    this.#showProblem({ cause: translate(cause), remedy: translate(remedy) });
  }

  #showProblem(problem: WebcamProblem): void {
    this.#card.setProgress(null);
    this.#card.setFollowing(false);
    this.#card.setProblem(problem);
  }

  #closeCamera(): void {
    this.#camera?.close();
    this.#camera = null;
    this.#mode.pause();
  }

  /** Let go while the page is in the background; switch the camera off and leave the stage if it stays there. */
  #followVisibility(): void {
    clearTimeout(this.#hiddenTimer);
    if (!document.hidden) {
      if (this.#wasHidden) this.options.toast(translate("The camera was switched off while this page was hidden"));
      if (this.#wasHidden) this.stop();
      return;
    }
    if (!this.#camera) return;
    this.#mode.pause();
    this.#hiddenTimer = setTimeout(() => {
      this.#wasHidden = true;
      this.#closeCamera();
      this.#mode.close();
    }, HIDDEN_TIMEOUT_MS);
  }
}
