/**
 * Which stage time is put out with which frame of the audio device (`proto/NOTES.md`, Audio and stage). Pure.
 *
 * Frames are counted by the AudioContext, 48,000 a second, and scheduled in slots. A slot has a stage time at its start and a
 * speed; slots follow each other without a jump, and the speed is chosen so that the sound stays with the viewer's own clock.
 */

/** Frames of a slot: a sixteenth of a second, so that its start in seconds has no rounding. */
export const SLOT_FRAMES = 3_000;
export const SLOTS_PER_SECOND = 16;
/** Microseconds of a slot at speed 1. */
export const SLOT_US = 1e6 / SLOTS_PER_SECOND;

/** Of the speed: no listener hears it. */
const MAX_SPEED_OFFSET = 0.005;
/** What the speed changes by from slot to slot, at most. */
const MAX_SPEED_STEP = 0.0005;
/** Time in which an error is made good, microseconds, at least. */
const CORRECTION_TIME_US = 5e6;
/** Errors that are left alone, microseconds. */
const MAX_IGNORED_ERROR_US = 2e3;
/** Further off than this the sound is taken up anew: a reference clock on a restless line is not known better. */
const MAX_CORRECTED_ERROR_US = 150e3;

export interface Slot {
  /** It starts at frame `SLOT` times this. */
  readonly index: number;
  /** Stage time at its start, microseconds. */
  readonly stageTime: number;
  /** Microseconds of stage time a microsecond of the device's. */
  readonly speed: number;
  /** The same as of the slot before, unless the stage time jumps between the two. */
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

  /** The slot `index`, null where there is none. */
  slot(index: number): Slot | null {
    return this.slots.find((slot) => slot.index === index) ?? null;
  }

  /**
   * Adds slot `index`, after which the viewer's own stage time will be `own` when the slot's first frame is heard. Where the
   * sound before it is `silent` an error is made good at once: nobody hears the jump.
   */
  add(index: number, viewerTime: number, silent: boolean): Slot {
    const { last } = this;
    const expected = last && last.index === index - 1 ? stageTimeAtEnd(last) : null;
    const error = expected === null ? Infinity : viewerTime - expected;
    let slot: Slot;
    if (expected === null || Math.abs(error) > (silent ? MAX_IGNORED_ERROR_US : MAX_CORRECTED_ERROR_US)) {
      slot = { index, stageTime: viewerTime, speed: 1, run: ++this.runs };
    } else {
      const rest = Math.sign(error) * Math.max(Math.abs(error) - MAX_IGNORED_ERROR_US, 0);
      const wanted = Math.min(Math.max(rest / CORRECTION_TIME_US, -MAX_SPEED_OFFSET), MAX_SPEED_OFFSET);
      const before = last!.speed - 1;
      const speed = 1 + Math.min(Math.max(wanted, before - MAX_SPEED_STEP), before + MAX_SPEED_STEP);
      slot = { index, stageTime: expected, speed, run: last!.run };
    }
    this.slots.push(slot);
    return slot;
  }

  /** The stage time at a frame, any real, and the run it belongs to; null where no slot is there. */
  stageAt(frame: number): { time: number; run: number } | null {
    const slot = this.slot(Math.floor(frame / SLOT_FRAMES));
    return (
      slot && {
        time: slot.stageTime + ((frame - slot.index * SLOT_FRAMES) / SLOT_FRAMES) * slot.speed * SLOT_US,
        run: slot.run,
      }
    );
  }

  /** Forgets the slots before slot `index`. */
  dropBefore(index: number): void {
    while (this.slots.length > 0 && this.slots[0].index < index) this.slots.shift();
  }

  clear(): void {
    this.slots = [];
  }
}
