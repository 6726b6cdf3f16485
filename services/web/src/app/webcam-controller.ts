/** Control of the hands by camera: camera, detector and card. Loaded when the person asks for it. */

import { formatPercent } from "../i18n/number-format";
import { translate } from "../i18n/translator";
import type { BodyMessage } from "../input/body-input";
import { createWebcamCard, type WebcamCard, type WebcamProblem } from "../ui/webcam/webcam-card";
import { BodyCamera, type CameraFrame, ModelError, NO_HANDS } from "../webcam/body-camera";
import { CameraError, type CameraFailure, type CameraSource } from "../webcam/camera";
import type { LimbControls } from "./limb-controls";

/** Time in the background after which the camera is switched off, in milliseconds. */
export const HIDDEN_TIMEOUT_MS = 30_000;

const CAMERA_PROBLEMS: Readonly<Record<CameraFailure, WebcamProblem>> = {
  denied: {
    cause: "The browser may not use the camera",
    remedy: "Allow the camera for this page, at the symbol beside the address, then try again.",
  },
  missing: { cause: "There is no camera", remedy: "Connect a camera, then try again." },
  busy: {
    cause: "The camera is in use",
    remedy: "Close the other program or page that uses it, then try again.",
  },
  failed: { cause: "The camera has stopped", remedy: "Check that it is connected, then try again." },
};
const MODEL_PROBLEM: WebcamProblem = {
  cause: "Your hands cannot be detected here",
  remedy: "The detector could not be loaded or run. Check your connection, then try again, or use another browser.",
};

interface WebcamOptions {
  readonly root: HTMLElement;
  readonly source: CameraSource;
  /** Move the hands. `now` is the time of the picture in milliseconds. */
  move(hands: BodyMessage, now: number): void;
  /** The camera was stopped. */
  onStop(): void;
  toast(message: string): void;
}

/** The camera of the page while it is on. */
let current: WebcamController | null = null;

/** Switch the camera of the page on, or off. `onChange` is told whether it is on. */
export function toggleWebcam(
  toast: (message: string) => void,
  limbs: Pick<LimbControls, "moveBody">,
  onChange: (isOn: boolean) => void,
): void {
  if (current) {
    current.stop();
    return;
  }
  onChange(true);
  current = new WebcamController({
    root: document.body,
    source: navigator.mediaDevices,
    move: (hands, now) => limbs.moveBody(hands, now),
    onStop: () => {
      current = null;
      onChange(false);
    },
    toast,
  });
}

class WebcamController {
  readonly #card: WebcamCard;
  #camera: BodyCamera | null = null;
  #hiddenTimer: ReturnType<typeof setTimeout> | undefined;
  #wasHidden = false;
  readonly #onVisibilityChange = () => this.#followVisibility();

  constructor(private readonly options: WebcamOptions) {
    this.#card = createWebcamCard(options.root, {
      stop: () => this.stop(),
      recalibrate: () => this.#camera?.recalibrate(),
      retry: () => this.#start(),
    });
    document.addEventListener("visibilitychange", this.#onVisibilityChange);
    this.#start();
  }

  /** Switch the camera off, release the hands and remove the card. */
  stop(): void {
    this.#closeCamera();
    clearTimeout(this.#hiddenTimer);
    document.removeEventListener("visibilitychange", this.#onVisibilityChange);
    this.#card.remove();
    this.options.onStop();
  }

  #start(): void {
    const card = this.#card;
    card.setProblem(null);
    card.setStatus(translate("Allow the camera in your browser. Its picture never leaves this page."));
    this.#camera = new BodyCamera({
      source: this.options.source,
      onOpen: (video) => {
        this.#showProgress(0);
        video.addEventListener("loadeddata", () => card.mirror.draw({ video, body: null, hands: NO_HANDS }));
      },
      onProgress: (share) => this.#showProgress(share),
      onFrame: (frame) => this.#onFrame(frame),
      onError: (error) => this.#showError(error),
    });
  }

  #showProgress(share: number): void {
    this.#card.setStatus(translate("Loading the detector: {share}", { share: formatPercent(share) }));
    this.#card.setProgress(share);
  }

  #onFrame(frame: CameraFrame): void {
    // A picture from before the page was hidden.
    if (document.hidden) return;
    const { phase, progress, hands, now } = frame;
    this.options.move(hands, now);
    this.#card.mirror.draw(frame);
    this.#card.setFollowing(phase === "following");
    this.#card.setStatus(translate(statusOf(frame)));
    this.#card.setProgress(phase === "calibrating" ? progress : null);
  }

  #showError(error: unknown): void {
    this.#closeCamera();
    if (!(error instanceof CameraError) && !(error instanceof ModelError)) reportError(error);
    this.#card.setProgress(null);
    this.#card.setFollowing(false);
    this.#card.setProblem(
      error instanceof CameraError
        ? CAMERA_PROBLEMS[error.failure]
        : error instanceof ModelError
          ? MODEL_PROBLEM
          : CAMERA_PROBLEMS.failed,
    );
  }

  #closeCamera(): void {
    this.#camera?.close();
    this.#camera = null;
    this.options.move(NO_HANDS, performance.now());
  }

  /** Release the hands while the page is in the background, and switch the camera off if it stays there. */
  #followVisibility(): void {
    clearTimeout(this.#hiddenTimer);
    if (!document.hidden) {
      if (this.#wasHidden) this.options.toast(translate("The camera was switched off while this page was hidden"));
      if (this.#wasHidden) this.stop();
      return;
    }
    if (!this.#camera) return;
    this.options.move(NO_HANDS, performance.now());
    this.#hiddenTimer = setTimeout(() => {
      this.#wasHidden = true;
      this.#closeCamera();
    }, HIDDEN_TIMEOUT_MS);
  }
}

function statusOf({ phase, hands }: CameraFrame) {
  if (phase === "searching") return "Bring your head and shoulders into the picture";
  if (phase === "calibrating") return "Keep still for a moment";
  return hands.left === null && hands.right === null
    ? "Raise your hands into the picture"
    : "Your hands move the hands on the stage";
}
