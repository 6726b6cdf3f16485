/** Viewer of a motion or a session: receives a stream and provides the poses to draw at any instant. */

import { DamagedBlock } from "../codec/errors";
import type { SceneTrack } from "../codec/scene";
import type { BitrateLevel } from "../codec/timing";
import type { StagedPose } from "../motion/extension";
import type { StagedPerformer } from "../motion/placement";
import type { Figure } from "../motion/skeleton";
import type { AudioBlockStore } from "../playout/audio-store";
import type { MotionBlockStore } from "../playout/block-store";
import { ReferenceClock } from "../playout/clock";
import { PlayoutDelay } from "../playout/delay";
import { type LightState, lightStates } from "../playout/light-state";
import { type LeaderTime, PresentationClock } from "../playout/presentation-clock";
import { positionAt, TimelineHistory } from "../playout/timeline";
import { TrackSet } from "../playout/track-set";
import type { Live } from "../wire/live";
import type {
  CrowdPulls,
  Data,
  Description,
  Edit,
  Message,
  Presence,
  PropPresence,
  TimelineState,
} from "../wire/messages";
import { OVERLAY_FRAME_INTERVAL_US, type Overlay } from "../wire/overlay";
import { pageAccess } from "./access";
import type { LimbPredictor } from "./performer-view";
import { PerformerViewSet } from "./performer-view-set";
import { ReconnectingConnection } from "./reconnecting-connection";
import { ViewerReporter } from "./reporter";
import { buildResumeUrl } from "./resume-url";
import { marionetteSolverFactory, SolverLoader } from "./solver-loader";
import type { ViewerOptions } from "./viewer-options";
import { StatisticsCollector, type ViewerStatistics } from "./viewer-statistics";

export type Timeline = TimelineState;
export type { Presence, ViewerOptions, ViewerStatistics };

const NO_BLOCKS = new Int8Array(0);

/**
 * Viewer of a motion or a session.
 *
 * Events:
 * - "open": connected; "replaced" follows if a silent connection was replaced.
 * - "figure": a motion was described; "tracks": more of its tracks were.
 * - "timeline", "presence": there is a new one.
 * - "pulls": `crowdPulls` or `crowdTurns` changed.
 * - "blocks": `blocks` of the first performer changed.
 * - "closed" (a CustomEvent, detail: the reason): the connection is lost, or closed for good if `isClosed`.
 */
export class Viewer extends EventTarget {
  /** Reference clock, in microseconds of local time. */
  readonly clock = new ReferenceClock();
  /** True if the connection is closed for good. */
  isClosed = false;
  presence: Presence | null = null;
  /** Number and some places of the crowd's pulls, by number of the limb; limbs that nobody pulls have none. */
  readonly crowdPulls = new Map<number, CrowdPulls>();
  /** Limbs of the policy `turns` that follow this viewer's pull now. */
  readonly crowdTurns = new Set<number>();
  motion: string | null = null;
  readonly timelineHistory = new TimelineHistory();
  /** Source of the stage time that the audio presents at local `nowMs`; the stage follows it while it is not null. */
  leader: ((nowMs: number) => LeaderTime | null) | null = null;

  private readonly url: URL;
  private readonly now: () => number;
  private readonly performerViews: PerformerViewSet;
  private readonly connection: ReconnectingConnection;
  private readonly delay = new PlayoutDelay();
  private readonly presentationClock = new PresentationClock();
  private readonly collector: StatisticsCollector;
  private readonly reporter: ViewerReporter;
  private tracks: TrackSet | null = null;
  /** Private timeline to restore after a reconnect. */
  private resumeTimeline: TimelineState | null = null;

  constructor(options: ViewerOptions) {
    super();
    this.url = new URL(options.url);
    this.url.searchParams.set("extensions", "true");
    this.url.searchParams.set("parts", "body,fingers,face,contacts,props");
    this.now = options.now ?? (() => performance.now());
    const { access = pageAccess, solver = marionetteSolverFactory(access) } = options;
    const origin = this.url.origin.replace(/^ws/, "http");
    this.performerViews = new PerformerViewSet((figure) => new SolverLoader(figure, origin, solver));
    this.collector = new StatisticsCollector({
      clock: this.clock,
      delay: this.delay,
      performerViews: this.performerViews,
      startedAt: this.now(),
      isPinned: this.url.searchParams.has("rate"),
      translator: access.translator,
      isHidden: options.isHidden ?? (() => typeof document !== "undefined" && document.hidden),
    });
    this.connection = new ReconnectingConnection({
      url: () => access.authorizeSocketUrl(this.makeUrl()),
      expectsAnswers: true,
      translator: access.translator,
      onOpen: (replaced) => this.onOpen(replaced),
      onMessage: (message, bytes) => this.onMessage(message, bytes),
      onMalformed: () => void this.collector.damagedCount++,
      onClosed: (reason, final) => this.onClosed(reason, final),
    });
    this.reporter = new ViewerReporter(
      (message) => this.connection.send(message),
      this.now,
      () => this.collector.makeReport(this.bufferedUs()),
    );
  }

  /** Number of messages and blocks that could not be decoded. */
  get damagedCount(): number {
    return this.collector.damagedCount;
  }

  private get store(): MotionBlockStore | null {
    return this.tracks?.firstPerformer ?? null;
  }

  /** Performers by number, as far as described; null for one that cannot be played. */
  get performers(): readonly (StagedPerformer | null)[] {
    return this.performerViews.all;
  }

  /** Figure of the first performer, null before the first Description. */
  get figure(): Figure | null {
    return this.performers[0]?.figure ?? null;
  }

  /** Mean facing of the first performer on the stage, radians about y from z towards x. */
  get front(): number {
    return this.performers[0]?.front ?? 0;
  }

  /** Newest timeline. */
  get timeline(): Timeline | null {
    return this.timelineHistory.newest;
  }

  /** Duration of the motion in seconds, 0 before it is known. */
  get duration(): number {
    return (this.store?.track.durationUs ?? 0) / 1e6;
  }

  /** Level of each block of the first performer, -1 if it is missing; live storage. */
  get blocks(): Int8Array {
    return this.store?.levels ?? NO_BLOCKS;
  }

  /** Return the blocks of a performer of `motion`, or null if another motion is playing. */
  blocksOf(motion: string, performer = 0): MotionBlockStore | null {
    return (motion === this.motion && this.tracks?.performers[performer]) || null;
  }

  /** Bitrate levels of the motion, from the lowest to the highest. */
  get ladder(): readonly BitrateLevel[] {
    return this.store?.track.ladder ?? [];
  }

  /** Return the reference time at local `nowMs`, microseconds, or null before the server has sent its time. */
  clockTime(nowMs: number): number | null {
    return this.clock.hasEstimate ? this.clock.at(nowMs * 1000) : null;
  }

  /** Return the reference time that the stage presents at local `nowMs`: its own or the leader's, microseconds. */
  presentationTime(nowMs: number): number {
    return this.presentationClock.at(this.ownTime(nowMs), this.leader?.(nowMs) ?? null, nowMs * 1000);
  }

  /** Return the presentation time without a leader: the reference time minus the play-out delay. */
  ownTime(nowMs: number): number {
    return this.clock.at(nowMs * 1000) - this.delay.at(nowMs * 1000);
  }

  /** Blocks of the motion's audio, null if it has none. */
  get audio(): AudioBlockStore | null {
    return this.tracks?.audio ?? null;
  }

  /** True once the clock estimate will change little. */
  get isClockSettled(): boolean {
    return this.clock.isSettled;
  }

  /** Return the position in the motion at local `nowMs`, seconds. */
  positionAt(nowMs: number): number {
    const clock = this.presentationTime(nowMs);
    const timeline = this.timelineHistory.at(clock);
    return timeline ? positionAt(timeline, clock) / 1e6 : 0;
  }

  /**
   * Return the pose of a performer at local `nowMs`, placed on the stage: the motion or the live pose, the overlays of
   * controlled limbs, and the predictions of this page's own. Null before the first pose; while a block is missing the
   * last pose is kept. The next call for this performer reuses the storage.
   */
  poseAt(nowMs: number, performer = 0): StagedPose | null {
    const clock = this.presentationTime(nowMs);
    const timeline = this.timelineHistory.at(clock);
    if (!timeline || timeline.motion !== this.motion) return null;
    return this.performerViews.poseAt(performer, timeline, clock, nowMs);
  }

  /** Cameras and lights of the motion, in the Description's order. */
  get scenes(): readonly SceneTrack[] {
    return this.tracks?.scenes.map((store) => store.track) ?? [];
  }

  /**
   * Return the seven values of the camera or light `scenes[scene]` at local `nowMs` (`proto/codec.md`, 2.14).
   * Null before the first block; while a block is missing the last values are kept. The next call reuses the storage.
   */
  sceneAt(nowMs: number, scene = 0): Float64Array | null {
    const clock = this.presentationTime(nowMs);
    const timeline = this.timelineHistory.at(clock);
    if (!timeline || timeline.motion !== this.motion) return null;
    return this.tracks?.scenes[scene]?.sceneAt(positionAt(timeline, clock), timeline.loop, timeline.duration) ?? null;
  }

  /** Return `sceneAt` of the motion's camera: the first one. */
  cameraAt(nowMs: number): Float64Array | null {
    const camera = this.scenes.findIndex(({ kind }) => kind === "camera");
    return this.sceneAt(nowMs, camera);
  }

  /** Return the states of all lights whose first block was received. */
  lightsAt(nowMs: number): LightState[] {
    return lightStates(this.scenes, (scene) => this.sceneAt(nowMs, scene));
  }

  /**
   * Return the props on the stage at local `nowMs`: those of the session, then those of the motion, whose numbers are 8
   * and above (`proto/playback.md`, 4.12).
   */
  propsAt(nowMs: number): readonly PropPresence[] {
    const clock = this.presentationTime(nowMs);
    const timeline = this.timelineHistory.at(clock);
    const stored = timeline && timeline.motion === this.motion ? this.performerViews.propsAt(timeline, clock) : [];
    return [...(this.presence?.props ?? []), ...stored];
  }

  /** Show the limbs of `puppeteer` without the delay of the session. */
  attach(puppeteer: LimbPredictor): void {
    this.performerViews.predictor = puppeteer;
  }

  /**
   * Play, pause, seek (`position`, seconds) or loop the private timeline of a motion's stream. Return false if not
   * connected.
   */
  edit(change: { playing?: boolean; position?: number; loop?: boolean }): boolean {
    const { playing = null, position, loop = null } = change;
    const positionUs = position === undefined ? null : Math.max(0, Math.round(position * 1e6));
    return this.connection.send({ name: "Edit", playing, position: positionUs, loop } satisfies Edit);
  }

  /**
   * Pull a limb of a session that is open to the crowd (`presence.crowd`): a hand to a place in the shoulder's frame, in
   * arm lengths, a leg to the angle `x` in radians. It counts for 400 ms: send it again, at most 20 times per second.
   * Return false if not connected.
   */
  pull(limb: number, x: number, y = 0, z = 0): boolean {
    return this.connection.send({ name: "Pull", limb, place: [x, y, z] });
  }

  /** Return the current statistics. */
  statistics(): ViewerStatistics {
    return this.collector.summarise(this.now(), this.bufferedUs());
  }

  /** Record the time to draw a frame: the server uses it to choose a level. */
  recordFrame(frameMs: number): void {
    this.collector.addFrameTime(frameMs);
  }

  /** Close for good. */
  close(): void {
    this.connection.close();
  }

  /** Return the URL to connect to: after the first connection with the received blocks and the position. */
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
    this.collector.closeReason = null;
    this.resumeTimeline = this.timelineHistory.newest;
    this.crowdPulls.clear();
    this.crowdTurns.clear();
    this.clock.restart();
    this.timelineHistory.restart();
    this.reporter.restart();
    this.performerViews.loadSolvers();
    this.dispatch("open");
    if (replaced) this.dispatch("replaced");
  }

  private onClosed(reason: string, final: boolean): void {
    this.collector.closeReason = reason;
    this.isClosed = final;
    if (final) this.reporter.close();
    else this.reporter.pause();
    this.dispatchEvent(new CustomEvent("closed", { detail: reason }));
  }

  /** Return the motion buffered ahead of the position, microseconds. */
  private bufferedUs(): number {
    const timeline = this.timelineHistory.newest;
    if (!this.store || !timeline) return 0;
    return this.store.bufferedUs(this.positionAt(this.now()) * 1e6, timeline.loop);
  }

  private onMessage(message: Message, bytes: number): void {
    const now = this.now();
    this.collector.bitrate.add(now, bytes);
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
      case "Live":
        this.onLive(message, now);
        break;
      case "Presence":
        this.presence = message;
        this.dispatch("presence");
        break;
      case "CrowdPulls":
        if (message.count > 0) this.crowdPulls.set(message.limb, message);
        else this.crowdPulls.delete(message.limb);
        this.dispatch("pulls");
        break;
      case "CrowdTurn":
        if (message.yours) this.crowdTurns.add(message.limb);
        else this.crowdTurns.delete(message.limb);
        this.dispatch("pulls");
        break;
      case "Choice":
        this.collector.choice = message;
        break;
      case "Pong":
        this.clock.addSample(message.sent, message.received, message.answered, now * 1000);
        this.reporter.onPong(message.sequence);
        break;
    }
  }

  private onDescription(message: Description): void {
    // a motion id always names the same content, so the blocks stay valid
    if (message.motion === this.motion && this.tracks) {
      const { describedCount } = this.tracks;
      this.tracks.add(message.first ?? 0, message.tracks);
      this.performerViews.add(this.tracks);
      if (this.tracks.describedCount > describedCount) this.dispatch("tracks");
      return;
    }
    // further tracks of a motion whose first ones were not received
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
    const { resumeTimeline } = this;
    this.resumeTimeline = null;
    if (resumeTimeline && !this.isSession) {
      const { playing, loop } = resumeTimeline;
      if (playing !== message.playing || loop !== message.loop) this.edit({ playing, loop });
    }
    this.dispatch("timeline");
  }

  private storeBlock(message: Data, now: number): void {
    if (this.tracks?.extensions.has(message.track)) {
      if (!this.performerViews.putExtension(message)) this.collector.damagedCount++;
      return;
    }
    const store = this.tracks?.store(message.track);
    if (!store) return;
    try {
      if (!store.put(message.index, message.rate, message.block)) return;
    } catch (error) {
      if (!(error instanceof DamagedBlock)) throw error;
      this.collector.damagedCount++;
      return;
    }
    if (store !== this.store) return;
    this.collector.addDecodeTime(this.now() - now);
    this.dispatch("blocks");
  }

  private onOverlay(message: Overlay, now: number): void {
    this.performerViews.overlays.put(message);
    this.recordArrival(message.due, message.earlier.length + 1, now);
  }

  private onLive(message: Live, now: number): void {
    this.recordArrival(message.due, message.frames, now);
    this.collector.damagedCount += this.performerViews.putLive(message, now);
  }

  /** Adapt the play-out delay to a message of `frames` frames, the last due at clock time `due`. */
  private recordArrival(due: number, frames: number, now: number): void {
    const latenessUs = this.clock.at(now * 1000) - due;
    this.collector.addLateness(latenessUs / 1000);
    // the message is needed one frame before its first: interpolation towards that begins then
    if (Number.isFinite(this.clock.errorBound))
      this.delay.addLateness(latenessUs + frames * OVERLAY_FRAME_INTERVAL_US, now * 1000);
  }

  private dispatch(event: string): void {
    this.dispatchEvent(new Event(event));
  }
}
