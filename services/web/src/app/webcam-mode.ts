/** What the person before the camera does on the stage. */
import type { PlainMessageKey } from "../i18n/translator";
import type { CameraFrame } from "../webcam/body-camera";
import type { Side } from "../webcam/body-view";
import type { Tracking } from "../webcam/person-tracker";

/** What has become of a picture. */
export interface CameraState extends Tracking {
  readonly status: PlainMessageKey;
  /** Hands that move something on the stage. */
  readonly activeHands: Readonly<Record<Side, boolean>>;
}

export const NO_ACTIVE_HANDS: CameraState["activeHands"] = { left: false, right: false };

export interface CameraMode {
  /** Act on the person in a picture. */
  follow(frame: CameraFrame): CameraState;
  /** Calibrate again. */
  recalibrate(): void;
  /** Let go for a while, as no pictures come. */
  pause(): void;
  /** End. Pictures may follow, and begin again. */
  close(): void;
}
