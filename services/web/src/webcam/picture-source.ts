/** Pictures of a stream, each when it is wanted: the newest one, and none twice. */

export interface TimedPicture {
  readonly picture: ImageBitmap;
  /** Time at which the camera took it, on the clock of `performance.now()`, in milliseconds. */
  readonly now: number;
}

export class PictureSource {
  readonly video: HTMLVideoElement;
  #isFresh = false;
  #takenAt = 0;
  #isWanted = false;
  #isClosed = false;

  /** `onPicture` receives the answers to `request`. */
  constructor(
    stream: MediaStream,
    private readonly onPicture: (picture: TimedPicture) => void,
  ) {
    this.video = document.createElement("video");
    this.video.muted = true;
    this.video.playsInline = true;
    this.video.srcObject = stream;
    // Playing is refused only to a page that is closed.
    this.video.play().catch(() => undefined);
    this.#watch();
  }

  /** Width of the pictures in their heights. */
  get aspect(): number {
    return this.video.videoWidth / this.video.videoHeight || 4 / 3;
  }

  /** Ask for the newest picture; it is given once there is one that was not given before. */
  request(): void {
    this.#isWanted = true;
    this.#give();
  }

  close(): void {
    this.#isClosed = true;
    this.video.srcObject = null;
  }

  #watch(): void {
    if (this.#isClosed) return;
    const onFrame = (now: number, captureTime?: number) => {
      this.#isFresh = this.video.videoWidth > 0;
      this.#takenAt = captureTime ?? now;
      this.#give();
      this.#watch();
    };
    // Browsers without this callback draw the video at every frame of the page.
    if ("requestVideoFrameCallback" in this.video)
      this.video.requestVideoFrameCallback((now, { captureTime }) => onFrame(now, captureTime));
    else requestAnimationFrame((now) => onFrame(now));
  }

  #give(): void {
    if (!this.#isWanted || !this.#isFresh || this.#isClosed) return;
    this.#isWanted = this.#isFresh = false;
    const now = this.#takenAt;
    createImageBitmap(this.video).then(
      (picture) => {
        if (this.#isClosed) picture.close();
        else this.onPicture({ picture, now });
      },
      // A video without a picture, as while the camera starts: the next frame has one.
      () => this.request(),
    );
  }
}
