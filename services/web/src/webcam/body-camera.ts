/** A camera and the worker that detects the person before it. */
import { type CameraSource, closeCamera, openCamera } from "./camera";
import type { DetectedBody } from "./landmark";
import { PictureSource } from "./picture-source";
import type { PictureMessage, WorkerMessage } from "./worker-message";

/** The model could not be loaded or run. */
export class ModelError extends Error {
  override readonly name = "ModelError";
}

/** Picture of the camera. */
export interface CameraFrame {
  /** The person in it; null if there is none. */
  readonly body: DetectedBody | null;
  /** Its width in its heights. */
  readonly aspect: number;
  readonly video: HTMLVideoElement;
  /** Time of the picture, in milliseconds. */
  readonly now: number;
}

export interface BodyCameraOptions {
  readonly source: CameraSource;
  /** The camera is open; the model loads. */
  onOpen(video: HTMLVideoElement): void;
  /** Share of the model that has arrived, 0 to 1. */
  onProgress(share: number): void;
  onFrame(frame: CameraFrame): void;
  /** The camera or the model has failed, or the camera was unplugged: it is closed. */
  onError(error: unknown): void;
}

export class BodyCamera {
  #stream: MediaStream | null = null;
  #pictures: PictureSource | null = null;
  #worker: Worker | null = null;
  #isClosed = false;

  constructor(private readonly options: BodyCameraOptions) {
    this.#open().catch((error: unknown) => this.#fail(error));
  }

  /** Switch the camera off and end the worker, also while they start. */
  close(): void {
    this.#isClosed = true;
    this.#worker?.terminate();
    this.#pictures?.close();
    if (this.#stream) closeCamera(this.#stream);
    this.#worker = this.#pictures = this.#stream = null;
  }

  async #open(): Promise<void> {
    const stream = await openCamera(this.options.source);
    if (this.#isClosed) {
      closeCamera(stream);
      return;
    }
    this.#stream = stream;
    for (const track of stream.getVideoTracks())
      track.addEventListener("ended", () => this.#fail(new Error("The camera has ended.")));
    const worker = new Worker(new URL("./pose-worker.ts", import.meta.url), { type: "module" });
    this.#worker = worker;
    this.#pictures = new PictureSource(stream, ({ picture, now }) =>
      worker.postMessage({ picture, now } satisfies PictureMessage, [picture]),
    );
    worker.onmessage = ({ data }: MessageEvent<WorkerMessage>) => this.#onMessage(data);
    worker.onerror = (event) => {
      event.preventDefault();
      this.#fail(new ModelError(event.message));
    };
    this.options.onOpen(this.#pictures.video);
  }

  #onMessage(message: WorkerMessage): void {
    const pictures = this.#pictures;
    if (!pictures) return;
    switch (message.type) {
      case "progress":
        this.options.onProgress(message.share);
        break;
      case "ready":
        pictures.request();
        break;
      case "failed":
        this.#fail(new ModelError(message.message));
        break;
      case "body": {
        // The next picture is detected while this one is shown.
        pictures.request();
        const { body, now } = message;
        this.options.onFrame({ body, aspect: pictures.aspect, video: pictures.video, now });
        break;
      }
    }
  }

  #fail(error: unknown): void {
    if (this.#isClosed) return;
    this.close();
    this.options.onError(error);
  }
}
