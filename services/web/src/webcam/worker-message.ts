/** Messages between the page and the worker that detects a person in pictures. */
import type { DetectedBody } from "./landmark";

export interface PictureMessage {
  readonly picture: ImageBitmap;
  /** Time of the picture, in milliseconds. */
  readonly now: number;
}

export type WorkerMessage =
  /** Share of the model that has arrived, 0 to 1. */
  | { readonly type: "progress"; readonly share: number }
  | { readonly type: "ready" }
  /** The model cannot be loaded or run. */
  | { readonly type: "failed"; readonly message: string }
  /** Answer to a picture. */
  | { readonly type: "body"; readonly body: DetectedBody | null; readonly now: number };
