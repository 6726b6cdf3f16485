/** Periodic messages of a viewer: clock pings and reports (`proto/messages.md`, 3.6 and 3.8). */

import type { Ping, Report } from "../wire/messages";
import { PingSender } from "./ping-sender";

const REPORT_INTERVAL_MS = 1_000;

/** Sender of pings and reports over the current connection. */
export class ViewerReporter extends PingSender {
  private readonly reportTimer: ReturnType<typeof setInterval>;

  /**
   * @param send function that sends a message; false if not connected
   * @param now local clock, milliseconds
   * @param makeReport function that returns the current report
   */
  constructor(send: (message: Ping | Report) => boolean, now: () => number, makeReport: () => Omit<Report, "name">) {
    super(send, now);
    this.reportTimer = setInterval(
      () => this.isLimitReached || send({ name: "Report", ...makeReport() }),
      REPORT_INTERVAL_MS,
    );
  }

  /** Stop for good. */
  close(): void {
    this.pause();
    clearInterval(this.reportTimer);
  }
}
