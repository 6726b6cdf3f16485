/** What a viewer says by itself: it asks for the time, quickly at first, and tells how it fares (`proto/SPEC.md`, Ping and Report). */
import type { ClientMessage, Report } from "../wire/messages";

const INITIAL_PINGS = 8;
const INITIAL_PING_INTERVAL_MS = 60;
const PING_INTERVAL_MS = 2_000;
const REPORT_INTERVAL_MS = 1_000;
/** So many questions may be on their way: on a line that all but stands their answers would be all that it carries. */
const MAX_UNANSWERED_PINGS = 2;

export class ViewerReporter {
  private pingTimer: ReturnType<typeof setTimeout> | undefined;
  private pingCount = 0;
  private answeredCount = 0;
  private readonly reportTimer: ReturnType<typeof setInterval>;

  /** `send` says whether there is a line, `now` is local milliseconds. */
  constructor(
    private readonly send: (message: ClientMessage) => boolean,
    private readonly now: () => number,
    fares: () => Omit<Report, "name">,
  ) {
    this.reportTimer = setInterval(
      () => this.isLimitReached || send({ name: "Report", ...fares() }),
      REPORT_INTERVAL_MS,
    );
  }

  /** There is a new line. */
  restart(): void {
    this.pause();
    this.sendPing();
  }

  /** The question of this number was answered, and so were those before it. */
  onPong(sequence: number): void {
    const { isLimitReached: full } = this;
    this.answeredCount = Math.max(this.answeredCount, sequence + 1);
    if (full && this.pingTimer === undefined) this.sendPing();
  }

  /** There is no line. */
  pause(): void {
    clearTimeout(this.pingTimer);
    this.pingTimer = undefined;
    this.pingCount = this.answeredCount = 0;
  }

  /** There will be none. */
  close(): void {
    this.pause();
    clearInterval(this.reportTimer);
  }

  private get isLimitReached(): boolean {
    return this.pingCount - this.answeredCount >= MAX_UNANSWERED_PINGS;
  }

  private sendPing(): void {
    this.pingTimer = undefined;
    if (
      this.isLimitReached ||
      !this.send({ name: "Ping", sequence: this.pingCount, sent: Math.round(this.now() * 1000) })
    )
      return;
    this.pingCount++;
    this.pingTimer = setTimeout(
      () => this.sendPing(),
      this.pingCount < INITIAL_PINGS ? INITIAL_PING_INTERVAL_MS : PING_INTERVAL_MS,
    );
  }
}
