/** Clock pings over a connection (`proto/messages.md`, 3.6). */

import type { Ping } from "../wire/messages";

/** Pings of a new connection that are sent at the shorter interval. */
const INITIAL_PINGS = 8;
const INITIAL_PING_INTERVAL_MS = 60;
const PING_INTERVAL_MS = 2_000;
/** Pings in flight: on a stalled link their answers would use all of its bandwidth. */
const MAX_UNANSWERED_PINGS = 2;

/** Sender of pings over the current connection. */
export class PingSender {
  private pingTimer: ReturnType<typeof setTimeout> | undefined;
  private pingCount = 0;
  private answeredCount = 0;

  /**
   * @param sendMessage function that sends a message; false if not connected
   * @param now local clock, milliseconds
   */
  constructor(
    private readonly sendMessage: (message: Ping) => boolean,
    private readonly now: () => number,
  ) {}

  /** Start anew on a new connection. */
  restart(): void {
    this.pause();
    this.sendPing();
  }

  /** Record the answer to a ping and to all before it. */
  onPong(sequence: number): void {
    const { isLimitReached: wasLimitReached } = this;
    this.answeredCount = Math.max(this.answeredCount, sequence + 1);
    if (wasLimitReached && this.pingTimer === undefined) this.sendPing();
  }

  /** Stop until the next connection. */
  pause(): void {
    clearTimeout(this.pingTimer);
    this.pingTimer = undefined;
    this.pingCount = this.answeredCount = 0;
  }

  /** True while so many pings are unanswered that nothing more is sent. */
  protected get isLimitReached(): boolean {
    return this.pingCount - this.answeredCount >= MAX_UNANSWERED_PINGS;
  }

  private sendPing(): void {
    this.pingTimer = undefined;
    if (
      this.isLimitReached ||
      !this.sendMessage({ name: "Ping", sequence: this.pingCount, sent: Math.round(this.now() * 1000) })
    )
      return;
    this.pingCount++;
    this.pingTimer = setTimeout(
      () => this.sendPing(),
      this.pingCount < INITIAL_PINGS ? INITIAL_PING_INTERVAL_MS : PING_INTERVAL_MS,
    );
  }
}
