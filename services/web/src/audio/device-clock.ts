/**
 * Which frame of the audio device is heard at an instant of the page's clock. The device tells of it now and then, a little wrong
 * each time: the median of the last tellings counts, and what is told by it never steps. Pure; times are milliseconds.
 */

import { Slew } from "../playout/slew";
import { FRAMES_PER_SECOND } from "./speaker";

const MAX_SAMPLES = 7;
/** A telling this soon after another says nothing new. */
const MIN_SAMPLE_INTERVAL_MS = 12;
/** Time constant with which a device that stood still is followed, microseconds. */
const SLEW_TIME_CONSTANT_US = 50e3;
const FRAMES_PER_MS = FRAMES_PER_SECOND / 1000;

export class DeviceClock {
  private readonly offsets: number[] = [];
  private lastSampleMs = -Infinity;
  /** The page's clock minus the device's, microseconds. */
  private readonly offset = new Slew(SLEW_TIME_CONSTANT_US);

  /** Whether the device has told of anything yet. */
  get hasSample(): boolean {
    return this.offsets.length > 0;
  }

  /** Whether what the device would tell at `nowMs` counts: to ask it takes time. */
  isSampleDue(nowMs: number): boolean {
    return nowMs - this.lastSampleMs >= MIN_SAMPLE_INTERVAL_MS;
  }

  /** At `pageMs` of the page's clock the device puts out what is at `contextSeconds` of its own; told at `nowMs`. */
  addSample(contextSeconds: number, pageMs: number, nowMs: number): void {
    if (!this.isSampleDue(nowMs)) return;
    this.lastSampleMs = nowMs;
    const first = !this.hasSample;
    this.offsets.push(pageMs * 1000 - contextSeconds * 1e6);
    if (this.offsets.length > MAX_SAMPLES) this.offsets.shift();
    const sorted = this.offsets.toSorted((a, b) => a - b);
    const median = sorted[sorted.length >> 1];
    if (first) this.offset.start(median, median, nowMs * 1000);
    else this.offset.slewTo(median, nowMs * 1000);
  }

  /** The frame that is heard at `nowMs`, any real. */
  frameAt(nowMs: number): number {
    return (nowMs - this.offset.at(nowMs * 1000) / 1000) * FRAMES_PER_MS;
  }

  /** When frame `frame` is heard, by what is known at `nowMs`. */
  timeOfFrame(frame: number, nowMs: number): number {
    return frame / FRAMES_PER_MS + this.offset.at(nowMs * 1000) / 1000;
  }

  /** The device was stopped: what it told says nothing about later. */
  clear(): void {
    this.offsets.length = 0;
    this.lastSampleMs = -Infinity;
  }
}
