/** Performers of the current motion, and the playback statistics of the first one. */

import type { StagedPose } from "../motion/extension";
import { markControlledLegs } from "../motion/foot-contact";
import type { Figure } from "../motion/skeleton";
import type { ExtensionPoses } from "../playout/extension-poses";
import type { LivePoses } from "../playout/live-poses";
import { OverlayBuffer } from "../playout/overlay-buffer";
import { positionAt } from "../playout/timeline";
import type { TrackSet } from "../playout/track-set";
import type { Live } from "../wire/live";
import type { Data, PropPresence, TimelineState } from "../wire/messages";
import { type LimbPredictor, PerformerView } from "./performer-view";
import type { SolverLoader } from "./solver-loader";

/** Time after which loading the decoder of live poses is attempted again, milliseconds. */
const LIVE_RETRY_DELAY_MS = 2_000;
/** Parts whose tracks have states of frames, not values. */
const PARTS_WITHOUT_VALUES: readonly string[] = ["contacts", "props"];
/** Blocks of extensions that are kept until their code is loaded. */
const MAX_EARLY_BLOCKS = 256;

/** "starting": no pose yet. "stalled": a block is missing, and the last pose is shown. */
export type PlaybackState = "starting" | "stalled" | "playing";

/** Performers of the current motion. The first one's blocks determine the statistics. */
export class PerformerViewSet {
  /** Performers by number; null for one that cannot be played. */
  all: (PerformerView | null)[] = [];
  readonly overlays = new OverlayBuffer();
  /** Puppeteer whose limbs are predicted, if any. */
  predictor: LimbPredictor | null = null;
  /** Local time of the first pose, milliseconds. */
  firstPoseMs: number | null = null;
  /** Level of the shown block, -1 before the first. */
  level = -1;
  /** Number of missing blocks while playing. */
  gaps = 0;
  private missingBlock = -1;
  /** Live poses, null until a live performer needed their decoder. */
  live: LivePoses | null = null;
  private isLoadingLive = false;
  /** Extensions of the performers, null until their code is loaded. */
  private extensions: ExtensionPoses | null = null;
  private isLoadingExtensions = false;
  /** Blocks of extensions that arrived before their code. */
  private earlyBlocks: Data[] = [];
  private tracks: TrackSet | null = null;
  private stores: TrackSet["performers"] = [];

  /** @param createLoader function that creates the solver loader of a figure */
  constructor(private readonly createLoader: (figure: Figure) => SolverLoader) {}

  /** Playback state of the first performer. */
  get state(): PlaybackState {
    if (!this.all[0]?.hasPose) return "starting";
    return this.missingBlock >= 0 ? "stalled" : "playing";
  }

  /** Replace the performers by those of another motion. */
  reset(tracks: TrackSet): void {
    this.overlays.clear();
    this.missingBlock = this.level = -1;
    this.all = [];
    this.stores = tracks.performers;
    this.live?.reset(this.stores);
    this.tracks = tracks;
    this.extensions = null;
    this.earlyBlocks = [];
    this.add(tracks);
  }

  /** Add the performers that were described since the last call. */
  add({ performers, extensions }: TrackSet): void {
    for (let number = this.all.length; number < performers.length; number++) {
      const store = performers[number];
      this.all.push(store && new PerformerView(number, store, this.createLoader(store.track.figure)));
    }
    this.extensions?.add(extensions);
    this.requestExtensions(extensions);
  }

  /** Store a block of an extension; return false if it is damaged. */
  putExtension(block: Data): boolean {
    if (this.extensions && !this.isLoadingExtensions) return this.extensions.put(block);
    if (this.earlyBlocks.length < MAX_EARLY_BLOCKS) this.earlyBlocks.push(block);
    return true;
  }

  /** Load the missing solvers of the performers shown so far. */
  loadSolvers(): void {
    for (const view of this.all) if (view?.hasPose) view.loadSolver();
  }

  /**
   * Add live poses that arrived at local `nowMs`; return the number of damaged blocks. Messages that arrive before
   * their decoder has been loaded are left out: none depends on another.
   */
  putLive(message: Live, nowMs: number): number {
    if (this.live) return this.live.put(message, nowMs);
    if (message.blocks.size > 0) void this.loadLive();
    return 0;
  }

  /** Return the pose of a performer at presented clock time `clock`, local time `nowMs`: see `Viewer.poseAt`. */
  poseAt(performer: number, timeline: TimelineState, clock: number, nowMs: number): StagedPose | null {
    const view = this.all[performer];
    if (!view) return null;
    const position = positionAt(timeline, clock);
    const seek = (other: PerformerView): "live" | "motion" | null => {
      if (this.live !== null && other.seekLive(this.live, clock)) return "live";
      return other.seek(position, timeline.loop, timeline.duration) ? "motion" : null;
    };
    const source = seek(view);
    const isLive = source === "live";
    if (isLive) {
      if (performer === 0) this.onPoseShown(nowMs);
    } else {
      const hasBlock = source !== null;
      if (performer === 0) {
        const index = view.store.track.blockAt(position);
        if (hasBlock) this.onBlockShown(view.store.levels[index], nowMs);
        else if (timeline.playing && view.hasPose) this.onBlockMissing(index);
      }
    }
    const { overlays, predictor } = this;
    const partner = (number: number) => {
      const other = this.all[number] ?? null;
      if (other) seek(other);
      return other;
    };
    const pose: StagedPose | null = view.pose({ clock, nowMs, overlays, predictor, partner });
    if (!pose) return null;
    pose.extended = pose.hands = pose.face = pose.contacts = null;
    if (!isLive)
      this.extensions
        ?.performer(performer)
        ?.extend(view.figure, pose, { clock, position, loop: timeline.loop, duration: timeline.duration });
    const { contacts } = pose as StagedPose;
    if (contacts) markControlledLegs(contacts, view.controlledLimbs);
    return pose;
  }

  /** Return the props of the motion at presented clock time `clock`. */
  propsAt(timeline: TimelineState, clock: number): readonly PropPresence[] {
    return this.extensions?.propsAt(positionAt(timeline, clock)) ?? [];
  }

  /** Load the missing code of extensions. That of contacts and props waits for the first pose, which they do not change. */
  private requestExtensions(extensions: TrackSet["extensions"]): void {
    const hasValues = [...extensions.values()].some(({ part }) => !PARTS_WITHOUT_VALUES.includes(String(part)));
    const isComplete = this.extensions && (this.extensions.openExtension || !hasValues);
    const isWanted = hasValues || (extensions.size > 0 && this.firstPoseMs !== null);
    if (isWanted && !isComplete) void this.loadExtensions(hasValues);
  }

  private async loadExtensions(hasValues: boolean): Promise<void> {
    if (this.isLoadingExtensions) return;
    this.isLoadingExtensions = true;
    try {
      const [{ ExtensionPoses }, values] = await Promise.all([
        import("../playout/extension-poses"),
        hasValues ? import("../playout/extension-values") : null,
      ]);
      if (!this.tracks) return;
      this.extensions ??= new ExtensionPoses();
      this.extensions.openExtension ??= values?.openExtension ?? null;
      this.extensions.add(this.tracks.extensions);
      for (const block of this.earlyBlocks.splice(0)) this.extensions.put(block);
    } catch {
      // the figures move without; the next motion tries again
      return;
    } finally {
      this.isLoadingExtensions = false;
    }
    // meanwhile another motion may have come
    this.requestExtensions(this.tracks.extensions);
  }

  private async loadLive(): Promise<void> {
    if (this.isLoadingLive) return;
    this.isLoadingLive = true;
    try {
      const { LivePoses } = await import("../playout/live-poses");
      this.live = new LivePoses(this.stores);
    } catch {
      setTimeout(() => (this.isLoadingLive = false), LIVE_RETRY_DELAY_MS);
    }
  }

  private onPoseShown(nowMs: number): void {
    this.missingBlock = -1;
    if (this.firstPoseMs !== null) return;
    this.firstPoseMs = nowMs;
    if (this.tracks && !this.extensions) this.requestExtensions(this.tracks.extensions);
  }

  private onBlockShown(level: number, nowMs: number): void {
    this.onPoseShown(nowMs);
    this.level = level;
  }

  private onBlockMissing(index: number): void {
    if (this.missingBlock === index) return;
    this.missingBlock = index;
    this.gaps++;
  }
}
