/**
 * A WebSocket of `bunraku.v1` that comes back by itself when it is lost. One that falls silent may be lost too, and the system finds that out after minutes
 * only: so another is tried beside it, and whichever is heard first is the line from then on.
 */

import { type PlainMessageKey, pageTranslator, type Translator } from "../i18n/translator";
import { pack, unpack } from "../wire/codec";
import { MalformedMessage } from "../wire/errors";
import { type ClientMessage, type Message, SUBPROTOCOL } from "../wire/messages";
import { ProblemError } from "./problem";

const INITIAL_RETRY_DELAY_MS = 250;
const MAX_RETRY_DELAY_MS = 4_000;
/** Nothing was heard for so long after something was said, milliseconds: another line is tried. */
const SILENCE_TIMEOUT_MS = 4_000;

/** Closes after which to come again would help nobody: done, contract broken, too large, not there, not spoken here. */
const FINAL_CLOSE_CODES = new Set([1000, 1008, 1009, 4403, 4404, 4406]);
/** What the address comes with is not good: who asked for it can ask for another. */
const UNAUTHORIZED_CLOSE_CODE = 4401;

/** Plain words for closes that bring none of their own. */
const CLOSE_REASONS: Readonly<Record<number, PlainMessageKey>> = {
  1000: "ended by the server",
  1006: "the connection was lost",
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
  expectsAnswers?: boolean;
  /** In whose words it is told why the line is gone: the page's, if nothing else is said. */
  translator?: Translator;
  /** There is a line; `replaced` where it takes the place of one that fell silent. */
  onOpen: (replaced: boolean) => void;
  onMessage: (message: Message, bytes: number) => void;
  /** A message that could not be read; the connection goes on. */
  onMalformed: (error: MalformedMessage) => void;
  /** The line is gone; `final` where it will not be tried again. */
  onClosed: (reason: string, final: boolean) => void;
}

export class ReconnectingConnection {
  private socket: WebSocket | null = null;
  /** Tried while the socket is silent. */
  private candidate: WebSocket | null = null;
  private retryDelay = INITIAL_RETRY_DELAY_MS;
  private retryTimer: ReturnType<typeof setTimeout> | undefined;
  private problem: string | null = null;
  private ended = false;
  /** Whether the address was asked for anew. */
  private usedFreshTicket = false;
  /** Counts what other lines were asked for: an address that comes too late is not used. */
  private attempt = 0;
  /** Since when an answer is waited for, local milliseconds. */
  private awaitingSince: number | null = null;
  private silenceTimer: ReturnType<typeof setTimeout> | undefined;

  private readonly translator: Translator;

  constructor(private readonly options: ConnectionOptions) {
    this.translator = options.translator ?? pageTranslator;
    this.connect();
  }

  /** Whether messages can be sent. */
  get isOpen(): boolean {
    return this.socket?.readyState === 1;
  }

  /** Bytes handed over and not sent yet: on a narrow line, how long what is sent now would wait. */
  get bufferedBytes(): number {
    return this.socket?.bufferedAmount ?? 0;
  }

  /** Sends a message; false where there is no line. */
  send(message: ClientMessage): boolean {
    if (!this.socket || !this.isOpen) return false;
    this.socket.send(pack(message));
    this.startSilenceTimer();
    return true;
  }

  /** Tries another line, as this one may be lost. */
  tryReplacement(): void {
    if (this.ended || !this.socket) return;
    this.candidate?.close(1000);
    this.candidate = null;
    const url = this.options.url();
    if (typeof url === "string") {
      this.candidate = this.createSocket(url);
      return;
    }
    const attempt = ++this.attempt;
    const dial = (found: string) => {
      if (attempt === this.attempt && this.socket) this.candidate = this.createSocket(found);
    };
    // without one there is no other line yet: the silent one is still there
    url.then(dial, () => undefined);
  }

  /** Ends it for good. */
  close(reason = this.translator.translate("closed here")): void {
    if (this.ended) return;
    this.ended = true;
    clearTimeout(this.retryTimer);
    clearTimeout(this.silenceTimer);
    const { socket, candidate: beside } = this;
    this.socket = this.candidate = null;
    socket?.close(1000);
    beside?.close(1000);
    this.options.onClosed(reason, true);
  }

  private connect(): void {
    this.problem = null;
    const url = this.options.url();
    this.usedFreshTicket = typeof url !== "string";
    if (typeof url === "string") this.openSocket(url);
    else
      url.then(
        (found) => this.ended || this.openSocket(found),
        (error: unknown) => this.ended || this.onUrlFailed(error),
      );
  }

  private openSocket(url: string): void {
    this.socket = this.createSocket(url);
    this.startSilenceTimer();
  }

  /** There is no address. */
  private onUrlFailed(error: unknown): void {
    if (error instanceof ProblemError && (error.status === 401 || error.status === 403)) this.close(error.message);
    else this.onSocketClosed(1006, error instanceof ProblemError ? error.detail : "");
  }

  private createSocket(url: string): WebSocket {
    const socket = new WebSocket(url, SUBPROTOCOL);
    socket.binaryType = "arraybuffer";
    socket.addEventListener("open", () => {
      if (socket === this.socket) this.options.onOpen(false);
    });
    socket.addEventListener("message", (event: MessageEvent<ArrayBuffer | string>) => {
      if (socket === this.candidate) this.promote(socket);
      if (socket === this.socket) this.receive(event.data);
    });
    socket.addEventListener("close", (event) => {
      if (socket === this.candidate) this.candidate = null;
      if (socket === this.socket) this.onSocketClosed(event.code, event.reason);
    });
    return socket;
  }

  /** The other line was heard first: the silent one is let go. */
  private promote(socket: WebSocket): void {
    this.socket?.close(1000);
    this.socket = socket;
    this.candidate = null;
    this.problem = null;
    this.options.onOpen(true);
  }

  private startSilenceTimer(): void {
    if (!this.options.expectsAnswers) return;
    this.awaitingSince ??= performance.now();
    this.silenceTimer ??= setTimeout(() => this.checkSilence(), SILENCE_TIMEOUT_MS);
  }

  private checkSilence(): void {
    this.silenceTimer = undefined;
    if (this.awaitingSince === null || !this.socket) return;
    const left = this.awaitingSince + SILENCE_TIMEOUT_MS - performance.now();
    if (left <= 0) this.tryReplacement();
    this.silenceTimer = setTimeout(() => this.checkSilence(), left > 0 ? left : SILENCE_TIMEOUT_MS);
  }

  private receive(data: ArrayBuffer | string): void {
    this.awaitingSince = null;
    this.attempt++;
    this.candidate?.close(1000);
    this.candidate = null;
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
    this.retryDelay = INITIAL_RETRY_DELAY_MS;
    if (message === null) return;
    const { translate, translateServerText } = this.translator;
    if (message.name === "Problem")
      this.problem = translate("{title}: {detail}", {
        title: translateServerText(message.title),
        detail: translateServerText(message.detail),
      });
    this.options.onMessage(message, data.byteLength);
  }

  private onSocketClosed(code: number, serverReason: string): void {
    this.attempt++;
    this.candidate?.close(1000);
    this.socket = this.candidate = this.awaitingSince = null;
    const { translate, translateServerText } = this.translator;
    const reason =
      this.problem ??
      (translateServerText(serverReason) ||
        (code in CLOSE_REASONS ? translate(CLOSE_REASONS[code]) : translate("closed with code {code}", { code })));
    this.ended = FINAL_CLOSE_CODES.has(code) || (code === UNAUTHORIZED_CLOSE_CODE && !this.usedFreshTicket);
    if (!this.ended) {
      this.retryTimer = setTimeout(() => this.connect(), this.retryDelay);
      this.retryDelay = Math.min(this.retryDelay * 2, MAX_RETRY_DELAY_MS);
    }
    this.options.onClosed(reason, this.ended);
  }
}
