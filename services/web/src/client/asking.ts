/** What a viewer says by itself: it asks for the time, quickly at first, and tells how it fares (`proto/SPEC.md`, Ping and Report). */
import type { ClientMessage, Report } from "../wire/messages";

const BURST = 8;
const BURST_EVERY = 60;
const ASK_EVERY = 2_000;
const REPORT_EVERY = 1_000;
/** So many questions may be on their way: on a line that all but stands their answers would be all that it carries. */
const UNANSWERED = 2;

export class Asking {
  private asking: ReturnType<typeof setTimeout> | undefined;
  private asked = 0;
  private replied = 0;
  private readonly reporting: ReturnType<typeof setInterval>;

  /** `send` says whether there is a line, `now` is local milliseconds. */
  constructor(
    private readonly send: (message: ClientMessage) => boolean,
    private readonly now: () => number,
    fares: () => Omit<Report, "name">,
  ) {
    this.reporting = setInterval(() => this.full || send({ name: "Report", ...fares() }), REPORT_EVERY);
  }

  /** There is a new line. */
  begin(): void {
    this.pause();
    this.ask();
  }

  /** The question of this number was answered, and so were those before it. */
  answered(sequence: number): void {
    const { full } = this;
    this.replied = Math.max(this.replied, sequence + 1);
    if (full && this.asking === undefined) this.ask();
  }

  /** There is no line. */
  pause(): void {
    clearTimeout(this.asking);
    this.asking = undefined;
    this.asked = this.replied = 0;
  }

  /** There will be none. */
  end(): void {
    this.pause();
    clearInterval(this.reporting);
  }

  private get full(): boolean {
    return this.asked - this.replied >= UNANSWERED;
  }

  private ask(): void {
    this.asking = undefined;
    if (this.full || !this.send({ name: "Ping", sequence: this.asked, sent: Math.round(this.now() * 1000) })) return;
    this.asked++;
    this.asking = setTimeout(() => this.ask(), this.asked < BURST ? BURST_EVERY : ASK_EVERY);
  }
}
