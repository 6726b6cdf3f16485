/**
 * Which frame of the audio device is heard at an instant of the page's clock. The device tells of it now and then, a little wrong
 * each time: the median of the last tellings counts, and what is told by it never steps. Pure; times are milliseconds.
 */

import { Slew } from "../playout/slew";
import { FRAMES_A_SECOND } from "./speaker";

const REMEMBERED = 7;
/** A telling this soon after another says nothing new. */
const SOON = 12;
/** Time constant with which a device that stood still is followed, microseconds. */
const QUICK = 50e3;
const FRAMES_A_MS = FRAMES_A_SECOND / 1000;

export class HeardClock {
  private readonly told: number[] = [];
  private last = -Infinity;
  /** The page's clock minus the device's, microseconds. */
  private readonly offset = new Slew(QUICK);

  /** Whether the device has told of anything yet. */
  get ready(): boolean {
    return this.told.length > 0;
  }

  /** Whether what the device would tell at `nowMs` counts: to ask it takes time. */
  due(nowMs: number): boolean {
    return nowMs - this.last >= SOON;
  }

  /** At `pageMs` of the page's clock the device puts out what is at `contextSeconds` of its own; told at `nowMs`. */
  sample(contextSeconds: number, pageMs: number, nowMs: number): void {
    if (!this.due(nowMs)) return;
    this.last = nowMs;
    const first = !this.ready;
    this.told.push(pageMs * 1000 - contextSeconds * 1e6);
    if (this.told.length > REMEMBERED) this.told.shift();
    const sorted = this.told.toSorted((a, b) => a - b);
    const median = sorted[sorted.length >> 1];
    if (first) this.offset.start(median, median, nowMs * 1000);
    else this.offset.aim(median, nowMs * 1000);
  }

  /** The frame that is heard at `nowMs`, any real. */
  frameAt(nowMs: number): number {
    return (nowMs - this.offset.at(nowMs * 1000) / 1000) * FRAMES_A_MS;
  }

  /** When frame `frame` is heard, by what is known at `nowMs`. */
  heardAt(frame: number, nowMs: number): number {
    return frame / FRAMES_A_MS + this.offset.at(nowMs * 1000) / 1000;
  }

  /** The device was stopped: what it told says nothing about later. */
  clear(): void {
    this.told.length = 0;
    this.last = -Infinity;
  }
}
