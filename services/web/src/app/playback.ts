/** The session, or the motion alone, being watched: its viewer and puppeteer, and the edits of its timeline. */
import { type Access, pageAccess } from "../client/access";
import { createSession, editSession, listSessions, type Session, type SessionEdit } from "../client/api";
import { Puppeteer } from "../client/puppeteer";
import { Viewer } from "../client/viewer";

/** After a seek the bar stands where it was put until the line has followed, at most this long. Milliseconds. */
const SEEK_SETTLE_TIMEOUT_MS = 1200;

/** The first session there is, else, for who may open one, a new one over the `newest` motion; null when there is nothing to dance. */
export async function findOrCreateSession(
  newestMotion: Promise<string | null>,
  access = pageAccess,
): Promise<Session | null> {
  const { items } = await listSessions(undefined, access);
  if (items.length > 0) return items[0];
  const motion = access.allows("control") ? await newestMotion : null;
  return motion ? createSession(motion) : null;
}

/** What is watched: a session, shared by all, or a motion, on a timeline of one's own. */
export type PlaybackKind = "sessions" | "motions";

export interface PlaybackOptions {
  kind?: PlaybackKind;
  /** How one comes in, and at which server. */
  access?: Access;
  /** Only to be watched: no limb is to be taken from here. */
  viewOnly?: boolean;
}

export class Playback {
  readonly kind: PlaybackKind;
  readonly access: Access;
  readonly viewer: Viewer;
  readonly puppeteer: Puppeteer;
  #editInFlight = false;
  #pendingEdit: SessionEdit | null = null;
  #pendingSeek: { seconds: number; at: number; epoch: number } | null = null;

  /** `failed` is told when an edit of the timeline was refused. */
  constructor(
    readonly id: string,
    name: string,
    private readonly onEditError: (error: unknown) => void,
    options: PlaybackOptions = {},
  ) {
    const { kind: place = "sessions", access = pageAccess, viewOnly: watching = false } = options;
    [this.kind, this.access] = [place, access];
    const base = `${(access.server || location.origin).replace(/^http/, "ws")}/v1/${place}/${encodeURIComponent(id)}`;
    const control =
      place === "sessions" && !watching && access.allows("control")
        ? `${base}/control?name=${encodeURIComponent(name)}`
        : null;
    this.viewer = new Viewer({ url: `${base}/stream`, access });
    this.puppeteer = new Puppeteer({ url: control, viewer: this.viewer, access });
    this.viewer.attach(this.puppeteer);
  }

  /** Seconds in the motion, or where a seek under way will land. */
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

  /** Seeks on by so many blocks, or back, within the dance. */
  seekByBlocks(blocks: number, now: number): void {
    const { blocks: all, duration } = this.viewer;
    if (all.length === 0) return;
    this.seek(Math.min(duration, Math.max(0, this.position(now) + (blocks * duration) / all.length)), now);
  }

  /** Whether the timeline may be edited from here. */
  get isEditable(): boolean {
    return this.kind === "motions" || this.access.allows("control");
  }

  /** Edits the timeline, of a session for everyone. One edit is under way at a time; those made meanwhile are sent as one. */
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
    }
    this.#editInFlight = false;
  }
}
