/**
 * Relation between the audio device's frames and the page's clock. The device reports its time occasionally and with
 * small errors: the median of the last samples is used, and the derived time never steps. Pure; times in milliseconds.
 */

import { Slew } from "../playout/slew";
import { FRAMES_PER_SECOND } from "./speaker";

const MAX_SAMPLES = 7;
/** Samples this soon after another carry no new information, in milliseconds. */
const MIN_SAMPLE_INTERVAL_MS = 12;
/** Time constant with which a device that paused is followed, in microseconds. */
const SLEW_TIME_CONSTANT_US = 50e3;
const FRAMES_PER_MS = FRAMES_PER_SECOND / 1000;

export class DeviceClock {
  private readonly offsets: number[] = [];
  private lastSampleMs = -Infinity;
  /** Page clock minus device clock, in microseconds. */
  private readonly offset = new Slew(SLEW_TIME_CONSTANT_US);

  /** True if there is a sample. */
  get hasSample(): boolean {
    return this.offsets.length > 0;
  }

  /** Return whether a sample at `nowMs` would be used: querying the device takes time. */
  isSampleDue(nowMs: number): boolean {
    return nowMs - this.lastSampleMs >= MIN_SAMPLE_INTERVAL_MS;
  }

  /**
   * Add a sample taken at `nowMs`: at `pageMs` of the page's clock the device plays the frame at `contextSeconds` of
   * its own.
   */
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

  /** Return the frame that is heard at `nowMs`, fractional. */
  frameAt(nowMs: number): number {
    return (nowMs - this.offset.at(nowMs * 1000) / 1000) * FRAMES_PER_MS;
  }

  /** Return the time at which a frame is heard, from the samples up to `nowMs`, in milliseconds. */
  timeOfFrame(frame: number, nowMs: number): number {
    return frame / FRAMES_PER_MS + this.offset.at(nowMs * 1000) / 1000;
  }

  /** Remove all samples after the device was suspended. */
  clear(): void {
    this.offsets.length = 0;
    this.lastSampleMs = -Infinity;
  }
}
