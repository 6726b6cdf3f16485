/** Bytes that came over the last seconds, as a rate. Times are local milliseconds. */

const SLOT = 250;
const SLOTS = 12;

export class Meter {
  private readonly slots = new Float64Array(SLOTS);
  private newest = -1;
  private first = -1;

  add(nowMs: number, bytes: number): void {
    this.advance(nowMs);
    this.slots[this.newest % SLOTS] += bytes;
  }

  /** Kilobits a second over the last three seconds, or since the first byte. */
  kbps(nowMs: number): number {
    if (this.first < 0) return 0;
    this.advance(nowMs);
    const milliseconds = nowMs - Math.max(this.newest - SLOTS + 1, this.first) * SLOT;
    return (this.slots.reduce((sum, bytes) => sum + bytes, 0) * 8) / Math.max(milliseconds, SLOT);
  }

  private advance(nowMs: number): void {
    const slot = Math.floor(nowMs / SLOT);
    if (this.first < 0) this.first = this.newest = slot;
    for (const from = Math.max(this.newest, slot - SLOTS); this.newest < slot; ) {
      this.newest = Math.max(this.newest, from) + 1;
      this.slots[this.newest % SLOTS] = 0;
    }
  }
}
