/**
 * Schedule of stage time on the frames of the audio device (`proto/NOTES.md`, Audio and stage). Pure.
 *
 * Frames are counted by the AudioContext, 48,000 per second, and scheduled in slots. A slot has a stage time at its
 * start and a speed; slots join without a jump, and the speed keeps the sound in sync with the viewer's clock.
 */

/** Frames per slot: 1/16 s, so that the start of a slot in seconds is exact. */
export const SLOT_FRAMES = 3_000;
export const SLOTS_PER_SECOND = 16;
/** Duration of a slot at speed 1, in microseconds. */
export const SLOT_US = 1e6 / SLOTS_PER_SECOND;

/** Maximum deviation of the speed: it is inaudible. */
const MAX_SPEED_OFFSET = 0.005;
/** Maximum change of the speed from slot to slot. */
const MAX_SPEED_STEP = 0.0005;
/** Minimum time over which an error is corrected, in microseconds. */
const CORRECTION_TIME_US = 5e6;
/** Errors up to this are ignored, in microseconds. */
const MAX_IGNORED_ERROR_US = 2e3;
/**
 * Above this error the sound is restarted, in microseconds: the estimate of the reference clock is as inaccurate
 * on a connection with much jitter.
 */
const MAX_CORRECTED_ERROR_US = 150e3;

export interface Slot {
  /** The slot starts at frame `index * SLOT_FRAMES`. */
  readonly index: number;
  /** Stage time at its start, in microseconds. */
  readonly stageTime: number;
  /** Stage time per device time. */
  readonly speed: number;
  /** Same as that of the last slot unless the stage time jumps between them. */
  readonly run: number;
}

export function stageTimeAtEnd(slot: Slot): number {
  return slot.stageTime + slot.speed * SLOT_US;
}

export class Schedule {
  private slots: Slot[] = [];
  private runs = 0;

  get last(): Slot | null {
    return this.slots.at(-1) ?? null;
  }

  /** Return slot `index`, or null. */
  slot(index: number): Slot | null {
    return this.slots.find((slot) => slot.index === index) ?? null;
  }

  /**
   * Add slot `index`, whose first frame will be heard when the viewer's own stage time is `viewerTime`. After silence
   * an error is corrected at once: the jump is inaudible.
   */
  add(index: number, viewerTime: number, isAfterSilence: boolean): Slot {
    const { last } = this;
    const expected = last && last.index === index - 1 ? stageTimeAtEnd(last) : null;
    const error = expected === null ? Infinity : viewerTime - expected;
    let slot: Slot;
    if (expected === null || Math.abs(error) > (isAfterSilence ? MAX_IGNORED_ERROR_US : MAX_CORRECTED_ERROR_US)) {
      slot = { index, stageTime: viewerTime, speed: 1, run: ++this.runs };
    } else {
      const excess = Math.sign(error) * Math.max(Math.abs(error) - MAX_IGNORED_ERROR_US, 0);
      const targetOffset = Math.min(Math.max(excess / CORRECTION_TIME_US, -MAX_SPEED_OFFSET), MAX_SPEED_OFFSET);
      const lastOffset = last!.speed - 1;
      const speed = 1 + Math.min(Math.max(targetOffset, lastOffset - MAX_SPEED_STEP), lastOffset + MAX_SPEED_STEP);
      slot = { index, stageTime: expected, speed, run: last!.run };
    }
    this.slots.push(slot);
    return slot;
  }

  /** Return the stage time at a fractional frame and its run; null if there is no slot. */
  stageAt(frame: number): { time: number; run: number } | null {
    const slot = this.slot(Math.floor(frame / SLOT_FRAMES));
    return (
      slot && {
        time: slot.stageTime + ((frame - slot.index * SLOT_FRAMES) / SLOT_FRAMES) * slot.speed * SLOT_US,
        run: slot.run,
      }
    );
  }

  /** Remove the slots before slot `index`. */
  dropBefore(index: number): void {
    while (this.slots.length > 0 && this.slots[0].index < index) this.slots.shift();
  }

  clear(): void {
    this.slots = [];
  }
}
