/**
 * A WebSocket of `bunraku.v1` that comes back by itself when it is lost. One that falls silent may be lost too, and the system finds that out after minutes
 * only: so another is tried beside it, and whichever is heard first is the line from then on.
 */

import { pack, unpack } from "../wire/codec";
import { MalformedMessage } from "../wire/errors";
import { type ClientMessage, type Message, SUBPROTOCOL } from "../wire/messages";
import { ProblemError } from "./problem";
import { pageSpeech, type Plain, type Speech } from "../words/say";

const FIRST_WAIT = 250;
const LONGEST_WAIT = 4_000;
/** Nothing was heard for so long after something was said, milliseconds: another line is tried. */
const SILENT = 4_000;

/** Closes after which to come again would help nobody: done, contract broken, too large, not there, not spoken here. */
const FINAL = new Set([1000, 1008, 1009, 4403, 4404, 4406]);
/** What the address comes with is not good: who asked for it can ask for another. */
const DENIED = 4401;

/** Plain words for closes that bring none of their own. */
const REASONS: Readonly<Record<number, Plain>> = {
  1000: "the server has ended it",
  1006: "the line was lost",
  1011: "the server failed",
  1012: "the server restarts",
  1013: "the server is too busy",
  4401: "a link is needed",
  4403: "your link is not for this",
  4404: "there is no such motion or session",
  4406: "the server speaks another version",
};

export interface ConnectionOptions {
  /** Where to; asked before every attempt. One that comes later may be good for this attempt alone. */
  url: () => string | Promise<string>;
  /** Whether the other end answers what is said soon: then its silence counts. */
  answered?: boolean;
  /** In whose words it is told why the line is gone: the page's, if nothing else is said. */
  speech?: Speech;
  /** There is a line; `replaced` where it takes the place of one that fell silent. */
  onOpen: (replaced: boolean) => void;
  onMessage: (message: Message, bytes: number) => void;
  /** A message that could not be read; the connection goes on. */
  onMalformed: (error: MalformedMessage) => void;
  /** The line is gone; `final` where it will not be tried again. */
  onClosed: (reason: string, final: boolean) => void;
}

export class Connection {
  private socket: WebSocket | null = null;
  /** Tried while the socket is silent. */
  private beside: WebSocket | null = null;
  private wait = FIRST_WAIT;
  private timer: ReturnType<typeof setTimeout> | undefined;
  private problem: string | null = null;
  private ended = false;
  /** Whether the address was asked for anew. */
  private ticketed = false;
  /** Counts what other lines were asked for: an address that comes too late is not used. */
  private attempt = 0;
  /** Since when an answer is waited for, local milliseconds. */
  private askedAt: number | null = null;
  private listening: ReturnType<typeof setTimeout> | undefined;

  private readonly speech: Speech;

  constructor(private readonly options: ConnectionOptions) {
    this.speech = options.speech ?? pageSpeech;
    this.connect();
  }

  /** Whether messages can be sent. */
  get open(): boolean {
    return this.socket?.readyState === 1;
  }

  /** Bytes handed over and not sent yet: on a narrow line, how long what is sent now would wait. */
  get waiting(): number {
    return this.socket?.bufferedAmount ?? 0;
  }

  /** Sends a message; false where there is no line. */
  send(message: ClientMessage): boolean {
    if (!this.socket || !this.open) return false;
    this.socket.send(pack(message));
    this.asked();
    return true;
  }

  /** Tries another line, as this one may be lost. */
  renew(): void {
    if (this.ended || !this.socket) return;
    this.beside?.close(1000);
    this.beside = null;
    const url = this.options.url();
    if (typeof url === "string") {
      this.beside = this.dial(url);
      return;
    }
    const attempt = ++this.attempt;
    const dial = (found: string) => {
      if (attempt === this.attempt && this.socket) this.beside = this.dial(found);
    };
    // without one there is no other line yet: the silent one is still there
    url.then(dial, () => undefined);
  }

  /** Ends it for good. */
  close(reason = this.speech.say("closed here")): void {
    if (this.ended) return;
    this.ended = true;
    clearTimeout(this.timer);
    clearTimeout(this.listening);
    const { socket, beside } = this;
    this.socket = this.beside = null;
    socket?.close(1000);
    beside?.close(1000);
    this.options.onClosed(reason, true);
  }

  private connect(): void {
    this.problem = null;
    const url = this.options.url();
    this.ticketed = typeof url !== "string";
    if (typeof url === "string") this.begin(url);
    else url.then((found) => this.ended || this.begin(found), (error: unknown) => this.ended || this.refused(error));
  }

  private begin(url: string): void {
    this.socket = this.dial(url);
    this.asked();
  }

  /** There is no address. */
  private refused(error: unknown): void {
    if (error instanceof ProblemError && (error.status === 401 || error.status === 403)) this.close(error.message);
    else this.lost(1006, error instanceof ProblemError ? error.detail : "");
  }

  private dial(url: string): WebSocket {
    const socket = new WebSocket(url, SUBPROTOCOL);
    socket.binaryType = "arraybuffer";
    socket.addEventListener("open", () => {
      if (socket === this.socket) this.options.onOpen(false);
    });
    socket.addEventListener("message", (event: MessageEvent<ArrayBuffer | string>) => {
      if (socket === this.beside) this.replace(socket);
      if (socket === this.socket) this.receive(event.data);
    });
    socket.addEventListener("close", (event) => {
      if (socket === this.beside) this.beside = null;
      if (socket === this.socket) this.lost(event.code, event.reason);
    });
    return socket;
  }

  /** The other line was heard first: the silent one is let go. */
  private replace(socket: WebSocket): void {
    this.socket?.close(1000);
    this.socket = socket;
    this.beside = null;
    this.problem = null;
    this.options.onOpen(true);
  }

  private asked(): void {
    if (!this.options.answered) return;
    this.askedAt ??= performance.now();
    this.listening ??= setTimeout(() => this.listen(), SILENT);
  }

  private listen(): void {
    this.listening = undefined;
    if (this.askedAt === null || !this.socket) return;
    const left = this.askedAt + SILENT - performance.now();
    if (left <= 0) this.renew();
    this.listening = setTimeout(() => this.listen(), left > 0 ? left : SILENT);
  }

  private receive(data: ArrayBuffer | string): void {
    this.askedAt = null;
    this.attempt++;
    this.beside?.close(1000);
    this.beside = null;
    if (typeof data === "string") {
      this.options.onMalformed(new MalformedMessage("a message was text; all are binary"));
      return;
    }
    let message: Message | null;
    try {
      message = unpack(new Uint8Array(data));
    } catch (error) {
      if (!(error instanceof MalformedMessage)) throw error;
      this.options.onMalformed(error);
      return;
    }
    this.wait = FIRST_WAIT;
    if (message === null) return;
    const { say, heard } = this.speech;
    if (message.name === "Problem") this.problem = say("{title}: {detail}", { title: heard(message.title), detail: heard(message.detail) });
    this.options.onMessage(message, data.byteLength);
  }

  private lost(code: number, said: string): void {
    this.attempt++;
    this.beside?.close(1000);
    this.socket = this.beside = this.askedAt = null;
    const { say, heard } = this.speech;
    const reason = this.problem ?? (heard(said) || (code in REASONS ? say(REASONS[code]) : say("closed with code {code}", { code })));
    this.ended = FINAL.has(code) || (code === DENIED && !this.ticketed);
    if (!this.ended) {
      this.timer = setTimeout(() => this.connect(), this.wait);
      this.wait = Math.min(this.wait * 2, LONGEST_WAIT);
    }
    this.options.onClosed(reason, this.ended);
  }
}
