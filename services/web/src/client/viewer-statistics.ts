/** Statistics of a viewer and their collector. */

import type { Translator } from "../i18n/translator";
import type { ReferenceClock } from "../playout/clock";
import type { PlayoutDelay } from "../playout/delay";
import type { Choice, Report } from "../wire/messages";
import { BitrateMeter } from "./bitrate-meter";
import type { PerformerViewSet } from "./performer-view-set";
import { describeStatus } from "./viewer-status";

/** Statistics of a viewer. Numbers are null while they are unknown. */
export interface ViewerStatistics {
  /** Bitrate level chosen by the server, or shown if it has sent no choice; -1 before the first block. */
  rate: number;
  /** Received bitrate of all messages, kbit/s. */
  kbps: number;
  /** Motion buffered ahead of the position, seconds. */
  bufferSeconds: number;
  /** Reference clock minus the clock of this machine. */
  clockOffsetMs: number | null;
  /** Maximum error of the clock estimate. */
  clockErrorMs: number | null;
  /** Mean lateness of overlays and live poses; negative if they arrive before they are due. */
  latencyMs: number | null;
  /** Delay of the stage behind the reference clock, so that overlays and live poses arrive before they are due. */
  playoutDelayMs: number;
  /** Time from the capture of a live performer's pose until it is shown; null if nobody is live. */
  liveLatencyMs: number | null;
  /** Time from the creation of the viewer to its first pose. */
  firstPoseMs: number | null;
  /** Number of missing blocks while playing. */
  gaps: number;
  /** Reason for the level or the missing picture, as a text for the user. */
  reason: string;
}

/** Weight of the newest sample in moving averages. */
const NEWEST_WEIGHT = 1 / 8;

/** Sources of a viewer's statistics. */
export interface StatisticsSources {
  readonly clock: ReferenceClock;
  readonly delay: PlayoutDelay;
  readonly performerViews: PerformerViewSet;
  /** Local time at which the viewer was created, milliseconds. */
  readonly startedAt: number;
  /** True if the URL sets the bitrate level. */
  readonly isPinned: boolean;
  readonly translator: Translator;
  /** Return true while nobody sees the stage. */
  readonly isHidden: () => boolean;
}

/** Collector of a viewer's measurements. Durations are moving averages in milliseconds. */
export class StatisticsCollector {
  readonly bitrate = new BitrateMeter();
  /** Number of messages and blocks that could not be decoded. */
  damagedCount = 0;
  /** Last choice of the server. */
  choice: Choice | null = null;
  /** Reason for the closed connection, null while it is open. */
  closeReason: string | null = null;
  private latencyMs: number | null = null;
  private decodeMs = 0;
  private frameMs = 0;

  constructor(private readonly sources: StatisticsSources) {}

  /** Add the lateness of an overlay or of live poses, negative if they arrived before they were due. */
  addLateness(ms: number): void {
    this.latencyMs = this.latencyMs === null ? ms : updateMean(this.latencyMs, ms);
  }

  /** Add the time to decode a block. */
  addDecodeTime(ms: number): void {
    this.decodeMs = this.decodeMs === 0 ? ms : updateMean(this.decodeMs, ms);
  }

  /** Add the time to draw a frame. */
  addFrameTime(ms: number): void {
    this.frameMs = updateMean(this.frameMs, ms);
  }

  /** Return the statistics at local `nowMs`, with `bufferedUs` microseconds of motion buffered. */
  summarise(nowMs: number, bufferedUs: number): ViewerStatistics {
    const { clock, delay, performerViews, startedAt, isPinned, translator } = this.sources;
    const { firstPoseMs, level, gaps, state: playback } = performerViews;
    const { damagedCount, choice, closeReason } = this;
    const playoutDelayMs = delay.at(nowMs * 1000) / 1000;
    const liveAgeMs = performerViews.live?.ageMs(nowMs) ?? null;
    const isSynchronised = Number.isFinite(clock.errorBound);
    return {
      rate: level < 0 ? -1 : (choice?.rate ?? level),
      kbps: this.bitrate.kbps(nowMs),
      bufferSeconds: bufferedUs / 1e6,
      clockOffsetMs: isSynchronised ? clock.offset / 1000 - performance.timeOrigin : null,
      clockErrorMs: isSynchronised ? clock.errorBound / 1000 : null,
      latencyMs: this.latencyMs,
      playoutDelayMs,
      liveLatencyMs: liveAgeMs === null ? null : liveAgeMs + playoutDelayMs,
      firstPoseMs: firstPoseMs === null ? null : firstPoseMs - startedAt,
      gaps,
      reason: describeStatus({ closeReason, damagedCount, playback, choice, isPinned }, translator),
    };
  }

  /** Return the report to the server. */
  makeReport(bufferedUs: number): Omit<Report, "name"> {
    return {
      buffer: Math.round(bufferedUs),
      decode: Math.round(this.decodeMs * 1000),
      frame: Math.round(this.frameMs * 1000),
      hidden: this.sources.isHidden(),
    };
  }
}

function updateMean(mean: number, sample: number): number {
  return mean + NEWEST_WEIGHT * (sample - mean);
}
