/** Elements of the page that follow the stage: name tags, messages, pointer and transport. */
import type { StageState } from "../engine/message";
import { showPointerState } from "../input/pointer-events";
import type { Page } from "../ui/page";
import type { RemotePlayback } from "./remote-playback";

export class StageOverlay {
  readonly #state: Partial<StageState> = {};
  /** Parts of the state that the page does not show yet. */
  #changes: Partial<StageState> = {};
  #isFrameRequested = false;

  constructor(
    private readonly canvas: HTMLCanvasElement,
    private readonly page: Pick<Page, "messageArea" | "nameTags" | "transport">,
    private readonly getPlayback: () => RemotePlayback | null,
  ) {}

  /** Show changes of the stage, and the position of the playback, at the next animation frame. */
  update(changes: Partial<StageState> | null = null): void {
    Object.assign(this.#changes, changes);
    if (this.#isFrameRequested) return;
    this.#isFrameRequested = true;
    requestAnimationFrame(() => this.#render());
  }

  #render(): void {
    this.#isFrameRequested = false;
    const { labels, faces } = this.#changes;
    const { canvas, page } = this;
    const state = Object.assign(this.#state, this.#changes);
    this.#changes = {};
    if (labels) page.nameTags.place(labels);
    if (faces) page.messageArea.avoidFaces(faces);
    const { isPointerNear = false, isPulling = false, hasMotionCamera = false, followsMotionCamera = false } = state;
    showPointerState(canvas, { isPointerNear, isPulling });
    page.transport.setCamera(hasMotionCamera, followsMotionCamera);
    const playback = this.getPlayback();
    if (!playback) return;
    page.transport.setPosition(playback.position, playback.duration);
    playback.sendLead(performance.now());
  }
}
