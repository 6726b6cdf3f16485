/** A viewer of a motion or a session: what comes over the line, and the pose to draw at any instant. */

import { DamagedBlock } from "../codec/errors";
import type { SceneTrack } from "../codec/scene";
import type { BitrateLevel } from "../codec/timing";
import type { Translator } from "../i18n/translator";
import type { StagedPerformer } from "../motion/placement";
import type { Figure, Pose } from "../motion/skeleton";
import type { AudioBlockStore } from "../playout/audio-store";
import type { MotionBlockStore } from "../playout/block-store";
import { ReferenceClock } from "../playout/clock";
import { PlayoutDelay } from "../playout/delay";
import { type LightState, lightStates } from "../playout/light-state";
import { type LeaderTime, PresentationClock } from "../playout/presentation-clock";
import { positionAt, TimelineHistory } from "../playout/timeline";
import { TrackSet } from "../playout/track-set";
import type { Choice, Data, Description, Edit, Message, Presence, Report, TimelineState } from "../wire/messages";
import { OVERLAY_FRAME_INTERVAL_US, type Overlay } from "../wire/overlay";
import { pageAccess } from "./access";
import { BitrateMeter } from "./bitrate-meter";
import { PerformerViewSet } from "./performer-view-set";
import type { Puppeteer } from "./puppeteer";
import { ReconnectingConnection } from "./reconnecting-connection";
import { ViewerReporter } from "./reporter";
import { buildResumeUrl } from "./resume-url";
import { marionetteSolverFactory, SolverLoader } from "./solver-loader";
import type { ViewerOptions } from "./viewer-options";
import type { ViewerStatistics } from "./viewer-statistics";
import { describeStatus } from "./viewer-status";

export type Timeline = TimelineState;
export type { Presence, ViewerOptions, ViewerStatistics };

/** Weight of the newest in running means. */
const NEWEST_WEIGHT = 1 / 8;

const NO_BLOCKS = new Int8Array(0);

/** Events: "figure", "tracks" (more of them are known), "timeline", "presence", "blocks", "open", "replaced" (by another line, as the one before fell silent), and "closed" (a CustomEvent whose detail is the reason). */
export class Viewer extends EventTarget {
  /** The reference clock, in microseconds of local time. */
  readonly clock = new ReferenceClock();
  /** Messages and blocks that could not be read. */
  damagedCount = 0;
  /** Whether the line is closed for good. */
  isClosed = false;
  presence: Presence | null = null;
  motion: string | null = null;
  puppeteer: Puppeteer | null = null;
  /** Which timelines hold, and will. */
  readonly timelineHistory = new TimelineHistory();
  /** What the stage follows while it is there: the stage time of the sound that is heard at local `nowMs`. */
  leader: ((nowMs: number) => LeaderTime | null) | null = null;

  private readonly url: URL;
  private readonly translator: Translator;
  private readonly now: () => number;
  private readonly performerViews: PerformerViewSet;
  private readonly connection: ReconnectingConnection;
  private readonly started: number;
  private readonly delay = new PlayoutDelay();
  private readonly presentationClock = new PresentationClock();
  private readonly bitrateMeter = new BitrateMeter();
  private readonly reporter: ViewerReporter;
  private tracks: TrackSet | null = null;
  private latencyMs: number | null = null;
  private decodeMs = 0;
  private frameMs = 0;
  private choice: Choice | null = null;
  private closedReason: string | null = null;
  /** The private timeline to go on with when the line comes back. */
  private resumeTimeline: TimelineState | null = null;

  constructor(options: ViewerOptions) {
    super();
    this.url = new URL(options.url);
    this.now = options.now ?? (() => performance.now());
    const { access = pageAccess, solver = marionetteSolverFactory(access) } = options;
    this.translator = access.translator;
    const origin = this.url.origin.replace(/^ws/, "http");
    this.performerViews = new PerformerViewSet((figure) => new SolverLoader(figure, origin, solver));
    this.started = this.now();
    this.connection = new ReconnectingConnection({
      url: () => access.authorizeSocketUrl(this.makeUrl()),
      expectsAnswers: true,
      translator: this.translator,
      onOpen: (replaced) => this.onOpen(replaced),
      onMessage: (message, bytes) => this.onMessage(message, bytes),
      onMalformed: () => void this.damagedCount++,
      onClosed: (reason, final) => this.onClosed(reason, final),
    });
    this.reporter = new ViewerReporter(
      (message) => this.connection.send(message),
      this.now,
      () => this.makeReport(),
    );
  }

  private get store(): MotionBlockStore | null {
    return this.tracks?.firstPerformer ?? null;
  }

  /** Those who dance, by number, as far as they are known; null one whose track cannot be read. The first is the show's. */
  get performers(): readonly (StagedPerformer | null)[] {
    return this.performerViews.all;
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
    return this.timelineHistory.newest;
  }

  /** Length of the motion in seconds, 0 before it is known. */
  get duration(): number {
    return (this.store?.track.durationUs ?? 0) / 1e6;
  }

  /** Per block of the first dance: -1 missing, else the best rate held. It is the live array. */
  get blocks(): Int8Array {
    return this.store?.levels ?? NO_BLOCKS;
  }

  /** The blocks of a performer's dance in `motion`, null where another is watched. */
  blocksOf(motion: string, performer = 0): MotionBlockStore | null {
    return (motion === this.motion && this.tracks?.performers[performer]) || null;
  }

  /** What each rate costs and keeps, from the lowest to the highest. */
  get ladder(): readonly BitrateLevel[] {
    return this.store?.track.ladder ?? [];
  }

  /** The reference time at local `nowMs`, microseconds; null before the server has told the time. */
  clockTime(nowMs: number): number | null {
    return this.clock.hasEstimate ? this.clock.at(nowMs * 1000) : null;
  }

  /** The reference time that the stage shows at local `nowMs`, microseconds: its own, or while sound is heard the sound's. */
  presentationTime(nowMs: number): number {
    return this.presentationClock.at(this.ownTime(nowMs), this.leader?.(nowMs) ?? null, nowMs * 1000);
  }

  /** What `shownTime` is without sound: the reference time less the play-out delay. */
  ownTime(nowMs: number): number {
    return this.clock.at(nowMs * 1000) - this.delay.at(nowMs * 1000);
  }

  /** The sound of the motion, null where it has none. */
  get audio(): AudioBlockStore | null {
    return this.tracks?.audio ?? null;
  }

  /** Seconds in the motion at local `nowMs`. */
  positionAt(nowMs: number): number {
    const clock = this.presentationTime(nowMs);
    const timeline = this.timelineHistory.at(clock);
    return timeline ? positionAt(timeline, clock) / 1e6 : 0;
  }

  /**
   * The pose of a performer to draw at local `nowMs`, as it stands on the stage: the dance, with what is pulled laid over it, and
   * one's own limbs as one pulls them. Null before there is any; where the block needed is missing the dance holds still. The
   * storage is used again by the next call for this performer.
   */
  poseAt(nowMs: number, performer = 0): Pose | null {
    const clock = this.presentationTime(nowMs);
    const timeline = this.timelineHistory.at(clock);
    if (!timeline || timeline.motion !== this.motion) return null;
    return this.performerViews.poseAt(performer, clock, timeline, this.puppeteer, nowMs);
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
    const clock = this.presentationTime(nowMs);
    const timeline = this.timelineHistory.at(clock);
    if (!timeline || timeline.motion !== this.motion) return null;
    return this.tracks?.scenes[scene]?.sceneAt(positionAt(timeline, clock), timeline.loop, timeline.duration) ?? null;
  }

  /** As `sceneAt`, of the show's camera: the first there is. */
  cameraAt(nowMs: number): Float64Array | null {
    return this.sceneAt(
      nowMs,
      this.scenes.findIndex(({ kind }) => kind === "camera"),
    );
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
  statistics(): ViewerStatistics {
    const { clock, store, performerViews: performances } = this;
    const { firstPoseMs, level: rate } = performances;
    const now = this.now();
    const timeline = this.timelineHistory.newest;
    const ahead = store && timeline ? store.bufferedUs(this.positionAt(now) * 1e6, timeline.loop) : 0;
    const known = Number.isFinite(clock.errorBound);
    return {
      rate: rate < 0 ? -1 : (this.choice?.rate ?? rate),
      kbps: this.bitrateMeter.kbps(now),
      bufferSeconds: ahead / 1e6,
      clockOffsetMs: known ? clock.offset / 1000 - performance.timeOrigin : null,
      clockErrorMs: known ? clock.errorBound / 1000 : null,
      latencyMs: this.latencyMs,
      playoutDelayMs: this.delay.at(now * 1000) / 1000,
      firstPoseMs: firstPoseMs === null ? null : firstPoseMs - this.started,
      gaps: performances.gaps,
      reason: describeStatus(
        {
          closeReason: this.closedReason,
          damagedCount: this.damagedCount,
          hasPose: performances.hasPose,
          isStalled: performances.isStalled,
          choice: this.choice,
          isPinned: this.url.searchParams.has("rate"),
        },
        this.translator,
      ),
    };
  }

  /** A frame was drawn and took `frameMs`: the server heeds it when it chooses a rate. */
  recordFrame(frameMs: number): void {
    this.frameMs += NEWEST_WEIGHT * (frameMs - this.frameMs);
  }

  /** Ends it for good. */
  close(): void {
    this.connection.close();
  }

  private makeUrl(): string {
    const { tracks } = this;
    const timeline = this.timelineHistory.newest;
    if (!tracks || !timeline || timeline.motion !== this.motion) return this.url.href;
    return buildResumeUrl(this.url, tracks, timeline, this.clock.at(this.now() * 1000), !this.isSession);
  }

  private get isSession(): boolean {
    return this.url.pathname.includes("/sessions/");
  }

  private onOpen(replaced: boolean): void {
    this.closedReason = null;
    this.resumeTimeline = this.timelineHistory.newest;
    this.clock.restart();
    this.timelineHistory.restart();
    this.reporter.restart();
    this.performerViews.loadSolvers();
    this.dispatch("open");
    if (replaced) this.dispatch("replaced");
  }

  private onClosed(reason: string, final: boolean): void {
    this.closedReason = reason;
    this.isClosed = final;
    if (final) this.reporter.close();
    else this.reporter.pause();
    this.dispatchEvent(new CustomEvent("closed", { detail: reason }));
  }

  private makeReport(): Omit<Report, "name"> {
    return {
      buffer: Math.round(this.statistics().bufferSeconds * 1e6),
      decode: Math.round(this.decodeMs * 1000),
      frame: Math.round(this.frameMs * 1000),
      hidden: typeof document !== "undefined" && document.hidden,
    };
  }

  private onMessage(message: Message, bytes: number): void {
    const now = this.now();
    this.bitrateMeter.add(now, bytes);
    switch (message.name) {
      case "ChannelHeader":
        this.clock.setEstimate(message.now, now * 1000);
        break;
      case "Description":
        this.onDescription(message);
        break;
      case "TimelineState":
        this.onTimeline(message);
        break;
      case "Data":
        this.storeBlock(message, now);
        break;
      case "Overlay":
        this.onOverlay(message, now);
        break;
      case "Presence":
        this.presence = message;
        this.dispatch("presence");
        break;
      case "Choice":
        this.choice = message;
        break;
      case "Pong":
        this.clock.addSample(message.sent, message.received, message.answered, now * 1000);
        this.reporter.onPong(message.sequence);
        break;
      default:
        break;
    }
  }

  private onDescription(message: Description): void {
    // what an id names never changes, so the blocks of the same motion are good still
    if (message.motion === this.motion && this.tracks) {
      const { describedCount: told } = this.tracks;
      this.tracks.add(message.first ?? 0, message.tracks);
      this.performerViews.add(this.tracks);
      if (this.tracks.describedCount > told) this.dispatch("tracks");
      return;
    }
    // the rest of one that was not told of
    if (message.first) return;
    try {
      this.tracks = new TrackSet(message.tracks);
    } catch (error) {
      if (!(error instanceof DamagedBlock)) throw error;
      this.connection.close(error.message);
      return;
    }
    this.motion = message.motion;
    this.performerViews.reset(this.tracks);
    this.dispatch("figure");
    this.dispatch("blocks");
  }

  private onTimeline(message: TimelineState): void {
    if (!this.timelineHistory.put(message)) return;
    const { resumeTimeline: resume } = this;
    this.resumeTimeline = null;
    if (resume && !this.isSession && (resume.playing !== message.playing || resume.loop !== message.loop)) {
      this.edit({ playing: resume.playing, loop: resume.loop });
    }
    this.dispatch("timeline");
  }

  private storeBlock(message: Data, now: number): void {
    const store = this.tracks?.store(message.track);
    if (!store) return;
    try {
      if (!store.put(message.index, message.rate, message.block)) return;
    } catch (error) {
      if (!(error instanceof DamagedBlock)) throw error;
      this.damagedCount++;
      return;
    }
    if (store !== this.store) return;
    const took = this.now() - now;
    this.decodeMs += (this.decodeMs === 0 ? 1 : NEWEST_WEIGHT) * (took - this.decodeMs);
    this.dispatch("blocks");
  }

  private onOverlay(message: Overlay, now: number): void {
    this.performerViews.overlays.put(message);
    const late = this.clock.at(now * 1000) - message.due;
    this.latencyMs =
      this.latencyMs === null ? late / 1000 : this.latencyMs + NEWEST_WEIGHT * (late / 1000 - this.latencyMs);
    // its first frame is gone to from the last one of the message before
    if (Number.isFinite(this.clock.errorBound))
      this.delay.addLateness(late + (message.earlier.length + 1) * OVERLAY_FRAME_INTERVAL_US, now * 1000);
  }

  private dispatch(event: string): void {
    this.dispatchEvent(new Event(event));
  }
}
