/** Received bitrate over a sliding window. Times are local milliseconds. */

const SLOT_MS = 250;
const SLOT_COUNT = 12;

/** Sliding window of received bytes, in slots of `SLOT_MS`. */
export class BitrateMeter {
  private readonly slots = new Float64Array(SLOT_COUNT);
  /** Numbers of the newest slot and of the first one ever used; -1 before the first byte. */
  private newest = -1;
  private first = -1;

  /** Add bytes received at `nowMs`. */
  add(nowMs: number, bytes: number): void {
    this.advance(nowMs);
    this.slots[this.newest % SLOT_COUNT] += bytes;
  }

  /** Return the bitrate over the last three seconds, or since the first byte, in kbit/s. */
  kbps(nowMs: number): number {
    if (this.first < 0) return 0;
    this.advance(nowMs);
    const elapsedMs = nowMs - Math.max(this.newest - SLOT_COUNT + 1, this.first) * SLOT_MS;
    return (this.slots.reduce((sum, bytes) => sum + bytes, 0) * 8) / Math.max(elapsedMs, SLOT_MS);
  }

  private advance(nowMs: number): void {
    const slot = Math.floor(nowMs / SLOT_MS);
    if (this.first < 0) this.first = this.newest = slot;
    for (const from = Math.max(this.newest, slot - SLOT_COUNT); this.newest < slot; ) {
      this.newest = Math.max(this.newest, from) + 1;
      this.slots[this.newest % SLOT_COUNT] = 0;
    }
  }
}
