/** A viewer of a motion or a session: what comes over the line, and the pose to draw at any instant. */

import { DamagedBlock } from "../codec/errors";
import type { SceneTrack } from "../codec/scene";
import type { Rate } from "../codec/timing";
import type { PerformerTrack } from "../motion/performer";
import type { Figure, Pose } from "../motion/skeleton";
import type { BlockStore } from "../playout/blocks";
import { ReferenceClock } from "../playout/clock";
import { PlayoutDelay } from "../playout/delay";
import { Following, type Lead } from "../playout/following";
import { type LightState, lightStates } from "../playout/scenes";
import type { AudioStore } from "../playout/sounds";
import { positionAt, Timelines } from "../playout/timeline";
import { Tracks } from "../playout/tracks";
import {
  type Choice, type Data, type Description, type Edit, type Message, type Presence, type Report, type TimelineState,
} from "../wire/messages";
import { type Overlay, OVERLAY_FRAME } from "../wire/overlay";
import type { Speech } from "../words/say";
import { pageAccess } from "./access";
import { Asking } from "./asking";
import { Connection } from "./connection";
import type { LineFigures } from "./line-figures";
import { Meter } from "./meter";
import type { Puppeteer } from "./puppeteer";
import { marionetteBy, OwnSolver } from "./own-solver";
import { Performances } from "./performances";
import { reasonOf } from "./reasons";
import { returningUrl } from "./returning";
import type { ViewerOptions } from "./viewer-options";

export type Timeline = TimelineState;
export type { LineFigures, Presence, ViewerOptions };

/** Weight of the newest in running means. */
const NEWEST = 1 / 8;

const NO_BLOCKS = new Int8Array(0);

/** Events: "figure", "tracks" (more of them are known), "timeline", "presence", "blocks", "open", "replaced" (by another line, as the one before fell silent), and "closed" (a CustomEvent whose detail is the reason). */
export class Viewer extends EventTarget {
  /** The reference clock, in microseconds of local time. */
  readonly clock = new ReferenceClock();
  /** Messages and blocks that could not be read. */
  damaged = 0;
  /** Whether the line is closed for good. */
  ended = false;
  presence: Presence | null = null;
  motion: string | null = null;
  puppeteer: Puppeteer | null = null;
  /** Which timelines hold, and will. */
  readonly timelines = new Timelines();
  /** What the stage follows while it is there: the stage time of the sound that is heard at local `nowMs`. */
  lead: ((nowMs: number) => Lead | null) | null = null;

  private readonly url: URL;
  private readonly speech: Speech;
  private readonly now: () => number;
  private readonly performances: Performances;
  private readonly connection: Connection;
  private readonly started: number;
  private readonly delay = new PlayoutDelay();
  private readonly following = new Following();
  private readonly meter = new Meter();
  private readonly asking: Asking;
  private tracks: Tracks | null = null;
  private latency: number | null = null;
  private decodeMs = 0;
  private frameMs = 0;
  private choice: Choice | null = null;
  private closedReason: string | null = null;
  /** The private timeline to go on with when the line comes back. */
  private resume: TimelineState | null = null;

  constructor(options: ViewerOptions) {
    super();
    this.url = new URL(options.url);
    this.now = options.now ?? (() => performance.now());
    const { access = pageAccess, solver = marionetteBy(access) } = options;
    this.speech = access.speech;
    const origin = this.url.origin.replace(/^ws/, "http");
    this.performances = new Performances((figure) => new OwnSolver(figure, origin, solver));
    this.started = this.now();
    this.connection = new Connection({
      url: () => access.ticketed(this.address()),
      answered: true,
      speech: this.speech,
      onOpen: (replaced) => this.opened(replaced),
      onMessage: (message, bytes) => this.receive(message, bytes),
      onMalformed: () => void this.damaged++,
      onClosed: (reason, final) => this.lost(reason, final),
    });
    this.asking = new Asking((message) => this.connection.send(message), this.now, () => this.fares());
  }

  private get store(): BlockStore | null {
    return this.tracks?.dance ?? null;
  }

  /** Those who dance, by number, as far as they are known; null one whose track cannot be read. The first is the show's. */
  get performers(): readonly (PerformerTrack | null)[] {
    return this.performances.all;
  }

  /** The first dancer's lengths, null before the first Description. */
  get figure(): Figure | null {
    return this.performers[0]?.figure ?? null;
  }

  /** Where the first dance faces over its length as it stands on the stage, radians about y from z towards x. */
  get front(): number {
    return this.performers[0]?.front ?? 0;
  }

  /** The newest timeline. */
  get timeline(): Timeline | null {
    return this.timelines.newest;
  }

  /** Length of the motion in seconds, 0 before it is known. */
  get duration(): number {
    return (this.store?.track.durationUs ?? 0) / 1e6;
  }

  /** Per block of the first dance: -1 missing, else the best rate held. It is the live array. */
  get blocks(): Int8Array {
    return this.store?.rates ?? NO_BLOCKS;
  }

  /** The blocks of a performer's dance in `motion`, null where another is watched. */
  held(motion: string, performer = 0): BlockStore | null {
    return (motion === this.motion && this.tracks?.performers[performer]) || null;
  }

  /** What each rate costs and keeps, from the lowest to the highest. */
  get rates(): readonly Rate[] {
    return this.store?.track.rates ?? [];
  }

  /** The reference time at local `nowMs`, microseconds; null before the server has told the time. */
  clockTime(nowMs: number): number | null {
    return this.clock.ready ? this.clock.at(nowMs * 1000) : null;
  }

  /** The reference time that the stage shows at local `nowMs`, microseconds: its own, or while sound is heard the sound's. */
  shownTime(nowMs: number): number {
    return this.following.at(this.ownTime(nowMs), this.lead?.(nowMs) ?? null, nowMs * 1000);
  }

  /** What `shownTime` is without sound: the reference time less the play-out delay. */
  ownTime(nowMs: number): number {
    return this.clock.at(nowMs * 1000) - this.delay.at(nowMs * 1000);
  }

  /** The sound of the motion, null where it has none. */
  get sound(): AudioStore | null {
    return this.tracks?.sound ?? null;
  }

  /** Seconds in the motion at local `nowMs`. */
  positionAt(nowMs: number): number {
    const clock = this.shownTime(nowMs);
    const timeline = this.timelines.at(clock);
    return timeline ? positionAt(timeline, clock) / 1e6 : 0;
  }

  /**
   * The pose of a performer to draw at local `nowMs`, as it stands on the stage: the dance, with what is pulled laid over it, and
   * one's own limbs as one pulls them. Null before there is any; where the block needed is missing the dance holds still. The
   * storage is used again by the next call for this performer.
   */
  poseAt(nowMs: number, performer = 0): Pose | null {
    const clock = this.shownTime(nowMs);
    const timeline = this.timelines.at(clock);
    if (!timeline || timeline.motion !== this.motion) return null;
    return this.performances.poseAt(performer, clock, timeline, this.puppeteer, nowMs);
  }

  /** Cameras and lights of the motion, in the Description's order. */
  get scenes(): readonly SceneTrack[] {
    return this.tracks?.scenes.map((store) => store.track) ?? [];
  }

  /**
   * The seven numbers of the camera or light `scenes[scene]` at local `nowMs` (`proto/SPEC.md`, Scene block); null before there
   * are any; where the block needed is missing they stand still. The storage is used again by the next call.
   */
  sceneAt(nowMs: number, scene = 0): Float64Array | null {
    const clock = this.shownTime(nowMs);
    const timeline = this.timelines.at(clock);
    if (!timeline || timeline.motion !== this.motion) return null;
    return this.tracks?.scenes[scene]?.sceneAt(positionAt(timeline, clock), timeline.loop, timeline.duration) ?? null;
  }

  /** As `sceneAt`, of the show's camera: the first there is. */
  cameraAt(nowMs: number): Float64Array | null {
    return this.sceneAt(nowMs, this.scenes.findIndex(({ kind }) => kind === "camera"));
  }

  /** As `sceneAt`, of every light of which anything is known yet. */
  lightsAt(nowMs: number): LightState[] {
    return lightStates(this.scenes, (scene) => this.sceneAt(nowMs, scene));
  }

  /** Shows `puppeteer`'s own limbs at once. */
  attach(puppeteer: Puppeteer): void {
    this.puppeteer = puppeteer;
  }

  /** Plays, pauses, seeks (`position`, seconds) or loops the private timeline of a motion's stream; false without a line. */
  edit(change: { playing?: boolean; position?: number; loop?: boolean }): boolean {
    const { playing = null, position, loop = null } = change;
    const at = position === undefined ? null : Math.max(0, Math.round(position * 1e6));
    return this.connection.send({ name: "Edit", playing, position: at, loop } satisfies Edit);
  }

  /** How the line fares now. */
  line(): LineFigures {
    const { clock, store, performances } = this;
    const { firstPoseMs, rate } = performances;
    const now = this.now();
    const timeline = this.timelines.newest;
    const ahead = store && timeline ? store.ahead(this.positionAt(now) * 1e6, timeline.loop) : 0;
    const known = Number.isFinite(clock.error);
    return {
      rate: rate < 0 ? -1 : (this.choice?.rate ?? rate),
      kbps: this.meter.kbps(now),
      bufferSeconds: ahead / 1e6,
      clockOffsetMs: known ? clock.offset / 1000 - performance.timeOrigin : null,
      clockErrorMs: known ? clock.error / 1000 : null,
      latencyMs: this.latency,
      playoutDelayMs: this.delay.at(now * 1000) / 1000,
      firstPoseMs: firstPoseMs === null ? null : firstPoseMs - this.started,
      gaps: performances.gaps,
      reason: reasonOf({
        closed: this.closedReason, damaged: this.damaged, shown: performances.shown, missing: performances.waiting, choice: this.choice, pinned: this.url.searchParams.has("rate"),
      }, this.speech),
    };
  }

  /** A frame was drawn and took `frameMs`: the server heeds it when it chooses a rate. */
  drawn(frameMs: number): void {
    this.frameMs += NEWEST * (frameMs - this.frameMs);
  }

  /** Ends it for good. */
  close(): void {
    this.connection.close();
  }

  private address(): string {
    const { tracks } = this;
    const timeline = this.timelines.newest;
    if (!tracks || !timeline || timeline.motion !== this.motion) return this.url.href;
    return returningUrl(this.url, tracks, timeline, this.clock.at(this.now() * 1000), !this.connectsToSession);
  }

  private get connectsToSession(): boolean {
    return this.url.pathname.includes("/sessions/");
  }

  private opened(replaced: boolean): void {
    this.closedReason = null;
    this.resume = this.timelines.newest;
    this.clock.restart();
    this.timelines.restart();
    this.asking.begin();
    this.performances.prepare();
    this.tell("open");
    if (replaced) this.tell("replaced");
  }

  private lost(reason: string, final: boolean): void {
    this.closedReason = reason;
    this.ended = final;
    if (final) this.asking.end();
    else this.asking.pause();
    this.dispatchEvent(new CustomEvent("closed", { detail: reason }));
  }

  private fares(): Omit<Report, "name"> {
    return {
      buffer: Math.round(this.line().bufferSeconds * 1e6),
      decode: Math.round(this.decodeMs * 1000),
      frame: Math.round(this.frameMs * 1000),
      hidden: typeof document !== "undefined" && document.hidden,
    };
  }

  private receive(message: Message, bytes: number): void {
    const now = this.now();
    this.meter.add(now, bytes);
    switch (message.name) {
      case "ChannelHeader":
        this.clock.greeting(message.now, now * 1000);
        break;
      case "Description":
        this.describe(message);
        break;
      case "TimelineState":
        this.retime(message);
        break;
      case "Data":
        this.keep(message, now);
        break;
      case "Overlay":
        this.overlay(message, now);
        break;
      case "Presence":
        this.presence = message;
        this.tell("presence");
        break;
      case "Choice":
        this.choice = message;
        break;
      case "Pong":
        this.clock.pong(message.sent, message.received, message.answered, now * 1000);
        this.asking.answered(message.sequence);
        break;
      default:
        break;
    }
  }

  private describe(message: Description): void {
    // what an id names never changes, so the blocks of the same motion are good still
    if (message.motion === this.motion && this.tracks) {
      const { told } = this.tracks;
      this.tracks.add(message.first ?? 0, message.tracks);
      this.performances.add(this.tracks);
      if (this.tracks.told > told) this.tell("tracks");
      return;
    }
    // the rest of one that was not told of
    if (message.first) return;
    try {
      this.tracks = new Tracks(message.tracks);
    } catch (error) {
      if (!(error instanceof DamagedBlock)) throw error;
      this.connection.close(error.message);
      return;
    }
    this.motion = message.motion;
    this.performances.begin(this.tracks);
    this.tell("figure");
    this.tell("blocks");
  }

  private retime(message: TimelineState): void {
    if (!this.timelines.put(message)) return;
    const { resume } = this;
    this.resume = null;
    if (resume && !this.connectsToSession && (resume.playing !== message.playing || resume.loop !== message.loop)) {
      this.edit({ playing: resume.playing, loop: resume.loop });
    }
    this.tell("timeline");
  }

  private keep(message: Data, now: number): void {
    const store = this.tracks?.store(message.track);
    if (!store) return;
    try {
      if (!store.put(message.index, message.rate, message.block)) return;
    } catch (error) {
      if (!(error instanceof DamagedBlock)) throw error;
      this.damaged++;
      return;
    }
    if (store !== this.store) return;
    const took = this.now() - now;
    this.decodeMs += (this.decodeMs === 0 ? 1 : NEWEST) * (took - this.decodeMs);
    this.tell("blocks");
  }

  private overlay(message: Overlay, now: number): void {
    this.performances.overlays.put(message);
    const late = this.clock.at(now * 1000) - message.due;
    this.latency = this.latency === null ? late / 1000 : this.latency + NEWEST * (late / 1000 - this.latency);
    // its first frame is gone to from the last one of the message before
    if (Number.isFinite(this.clock.error)) this.delay.heard(late + (message.earlier.length + 1) * OVERLAY_FRAME, now * 1000);
  }

  private tell(event: string): void {
    this.dispatchEvent(new Event(event));
  }
}
