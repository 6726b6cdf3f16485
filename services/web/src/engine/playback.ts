/** Playback of a session or of a single motion: its viewer, its puppeteer, and edits of its timeline. */
import { type Access, pageAccess } from "../client/access";
import { editSession, type SessionEdit } from "../client/api";
import { Puppeteer } from "../client/puppeteer";
import { Viewer } from "../client/viewer";

/** Longest time for which the seek bar shows the requested position before the timeline confirms it. */
const SEEK_SETTLE_TIMEOUT_MS = 1200;

/** Minimum time between two edits of a session: the server limits the changes of one subject. */
const EDIT_INTERVAL_MS = 60;

/** Kind of playback: a session, whose timeline all viewers share, or a motion on a private timeline. */
export type PlaybackKind = "sessions" | "motions";

export interface PlaybackOptions {
  kind?: PlaybackKind;
  /** Server and credentials; the page's own by default. */
  access?: Access;
  /** Open no control connection: limbs cannot be claimed. */
  viewOnly?: boolean;
  /** Return true while nobody sees the stage; by default while the page is in the background. */
  isHidden?: () => boolean;
}

export class Playback {
  readonly kind: PlaybackKind;
  readonly access: Access;
  readonly viewer: Viewer;
  readonly puppeteer: Puppeteer;
  #editInFlight = false;
  #pendingEdit: SessionEdit | null = null;
  #pendingSeek: { seconds: number; at: number; epoch: number } | null = null;

  /** `onEditError` is called if the server rejects an edit of the timeline. */
  constructor(
    readonly id: string,
    name: string,
    private readonly onEditError: (error: unknown) => void,
    options: PlaybackOptions = {},
  ) {
    const { kind = "sessions", access = pageAccess, viewOnly = false, isHidden } = options;
    [this.kind, this.access] = [kind, access];
    const base = `${(access.server || location.origin).replace(/^http/, "ws")}/v1/${kind}/${encodeURIComponent(id)}`;
    const control =
      kind === "sessions" && !viewOnly && access.allows("control")
        ? `${base}/control?name=${encodeURIComponent(name)}`
        : null;
    this.viewer = new Viewer({ url: `${base}/stream`, access, ...(isHidden ? { isHidden } : {}) });
    this.puppeteer = new Puppeteer({ url: control, viewer: this.viewer, access });
    this.viewer.attach(this.puppeteer);
  }

  /** Return the position in the motion in seconds, or the target of a pending seek, at local time `now` in ms. */
  position(now: number): number {
    const { timeline } = this.viewer;
    if (
      this.#pendingSeek &&
      (now - this.#pendingSeek.at > SEEK_SETTLE_TIMEOUT_MS ||
        (timeline !== null && timeline.epoch > this.#pendingSeek.epoch && !this.#editInFlight))
    ) {
      this.#pendingSeek = null;
    }
    return this.#pendingSeek?.seconds ?? this.viewer.positionAt(now);
  }

  seek(seconds: number, now: number): void {
    if (!this.isEditable) return;
    this.#pendingSeek = { seconds, at: now, epoch: this.viewer.timeline?.epoch ?? 0 };
    this.edit({ position: Math.round(seconds * 1e6) });
  }

  /** Seek by a number of blocks, negative to go back, within the motion. */
  seekByBlocks(blocks: number, now: number): void {
    const { blocks: all, duration } = this.viewer;
    if (all.length === 0) return;
    this.seek(Math.min(duration, Math.max(0, this.position(now) + (blocks * duration) / all.length)), now);
  }

  /** True if this page may edit the timeline. */
  get isEditable(): boolean {
    return this.kind === "motions" || this.access.allows("control");
  }

  /**
   * Edit the timeline, for all viewers if it is a session's. One request is in flight at a time; edits made meanwhile,
   * or within `EDIT_INTERVAL_MS`, are merged into the next one.
   */
  edit(change: SessionEdit): void {
    if (!this.isEditable) return;
    if (this.kind === "motions") {
      const { position, motion: _, ...rest } = change;
      this.viewer.edit(position === undefined ? rest : { ...rest, position: position / 1e6 });
      return;
    }
    this.#pendingEdit = { ...this.#pendingEdit, ...change };
    if (!this.#editInFlight) void this.#sendEdits();
  }

  close(): void {
    this.puppeteer.close();
    this.viewer.close();
  }

  async #sendEdits(): Promise<void> {
    this.#editInFlight = true;
    while (this.#pendingEdit) {
      const edit = this.#pendingEdit;
      this.#pendingEdit = null;
      try {
        await editSession(this.id, edit, this.access);
      } catch (error) {
        this.onEditError(error);
      }
      await new Promise((resolve) => setTimeout(resolve, EDIT_INTERVAL_MS));
    }
    this.#editInFlight = false;
  }
}
