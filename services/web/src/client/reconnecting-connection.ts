/**
 * WebSocket connection of `bunraku.v1` that reconnects when it is lost.
 *
 * A silent connection may be lost, which the operating system detects only after minutes. A second connection is
 * therefore attempted beside it, and whichever receives a message first becomes current.
 */

import { type PlainMessageKey, pageTranslator, type Translator } from "../i18n/translator";
import { packViewerMessage, unpackServerMessage, type ViewerMessage } from "../wire/client-codec";
import { MalformedMessage } from "../wire/errors";
import { type Message, SUBPROTOCOL } from "../wire/messages";
import { ProblemError } from "./problem";

const INITIAL_RETRY_DELAY_MS = 250;
const MAX_RETRY_DELAY_MS = 4_000;
/** Silence after a sent message, after which another connection is attempted. */
const SILENCE_TIMEOUT_MS = 4_000;

/** Closes after which a retry cannot succeed: normal, protocol error, too big, forbidden, not found, other version. */
const FINAL_CLOSE_CODES = new Set([1000, 1008, 1009, 4403, 4404, 4406]);
/** Credentials rejected: a retry can succeed with a new ticket. */
const UNAUTHORIZED_CLOSE_CODE = 4401;

/** Texts for close codes without a reason of the server. */
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

/** Options of a connection. */
export interface ConnectionOptions {
  /** Function called before each attempt; a promise resolves to a URL with a ticket for this attempt alone. */
  url: () => string | Promise<string>;
  /** True if the server answers each message soon, so that silence means a lost connection. */
  expectsAnswers?: boolean;
  /** Language of the close reasons; that of the page by default. */
  translator?: Translator;
  /** Listener for an open connection; `replaced` if it takes the place of a silent one. */
  onOpen: (replaced: boolean) => void;
  onMessage: (message: Message, bytes: number) => void;
  /** Listener for messages that cannot be decoded; the connection continues. */
  onMalformed: (error: MalformedMessage) => void;
  /** Listener for a lost connection; `final` if there is no retry. */
  onClosed: (reason: string, final: boolean) => void;
}

/** Connection that reconnects with exponential backoff. */
export class ReconnectingConnection {
  /** Current connection, open or connecting. */
  private socket: WebSocket | null = null;
  /** Connection that is attempted while the current one is silent. */
  private candidate: WebSocket | null = null;
  private retryDelay = INITIAL_RETRY_DELAY_MS;
  private retryTimer: ReturnType<typeof setTimeout> | undefined;
  /** Problem that the server announced before its close. */
  private problem: string | null = null;
  private isEnded = false;
  /** True if the current URL was issued for this attempt. */
  private usedFreshTicket = false;
  /** Number of the last replacement attempt: a URL that arrives later than its attempt is not used. */
  private attempt = 0;
  /** Time since which an answer is awaited, milliseconds of `performance.now`. */
  private awaitingSince: number | null = null;
  private silenceTimer: ReturnType<typeof setTimeout> | undefined;

  private readonly translator: Translator;

  constructor(private readonly options: ConnectionOptions) {
    this.translator = options.translator ?? pageTranslator;
    this.connect();
  }

  /** True if messages can be sent. */
  get isOpen(): boolean {
    return this.socket?.readyState === 1;
  }

  /** Bytes queued for sending: on a constrained link they delay further messages. */
  get bufferedBytes(): number {
    return this.socket?.bufferedAmount ?? 0;
  }

  /** Send a message. Return false if not connected. */
  send(message: ViewerMessage): boolean {
    return this.sendBytes(packViewerMessage(message));
  }

  /** Send an encoded message, of a type that `send` does not encode. Return false if not connected. */
  sendBytes(message: Uint8Array<ArrayBuffer>): boolean {
    if (!this.socket || !this.isOpen) return false;
    this.socket.send(message);
    this.startSilenceTimer();
    return true;
  }

  /** Attempt another connection, since the current one may be lost. */
  tryReplacement(): void {
    if (this.isEnded || !this.socket) return;
    this.candidate?.close(1000);
    this.candidate = null;
    const url = this.options.url();
    if (typeof url === "string") {
      this.candidate = this.createSocket(url);
      return;
    }
    const attempt = ++this.attempt;
    const openCandidate = (resolved: string) => {
      if (attempt === this.attempt && this.socket) this.candidate = this.createSocket(resolved);
    };
    // without a URL there is no attempt, and the silent connection stays current
    url.then(openCandidate, () => undefined);
  }

  /** Close for good. */
  close(reason = this.translator.translate("closed here")): void {
    if (this.isEnded) return;
    this.isEnded = true;
    clearTimeout(this.retryTimer);
    clearTimeout(this.silenceTimer);
    const { socket, candidate } = this;
    this.socket = this.candidate = null;
    socket?.close(1000);
    candidate?.close(1000);
    this.options.onClosed(reason, true);
  }

  private connect(): void {
    this.problem = null;
    const url = this.options.url();
    this.usedFreshTicket = typeof url !== "string";
    if (typeof url === "string") this.openSocket(url);
    else
      url.then(
        (resolved) => this.isEnded || this.openSocket(resolved),
        (error: unknown) => this.isEnded || this.onUrlFailed(error),
      );
  }

  private openSocket(url: string): void {
    this.socket = this.createSocket(url);
    this.startSilenceTimer();
  }

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

  /** Make the candidate current, since it received a message first. */
  private promote(candidate: WebSocket): void {
    this.socket?.close(1000);
    this.socket = candidate;
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
    const remaining = this.awaitingSince + SILENCE_TIMEOUT_MS - performance.now();
    if (remaining <= 0) this.tryReplacement();
    this.silenceTimer = setTimeout(() => this.checkSilence(), remaining > 0 ? remaining : SILENCE_TIMEOUT_MS);
  }

  private receive(data: ArrayBuffer | string): void {
    this.awaitingSince = null;
    this.cancelReplacement();
    if (typeof data === "string") {
      this.options.onMalformed(new MalformedMessage("Message is text, expected binary."));
      return;
    }
    let message: Message | null;
    try {
      message = unpackServerMessage(new Uint8Array(data));
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

  private cancelReplacement(): void {
    this.attempt++;
    this.candidate?.close(1000);
    this.candidate = null;
  }

  private onSocketClosed(code: number, serverReason: string): void {
    this.cancelReplacement();
    this.socket = this.awaitingSince = null;
    const reason = this.problem ?? this.describeClose(code, serverReason);
    this.isEnded = FINAL_CLOSE_CODES.has(code) || (code === UNAUTHORIZED_CLOSE_CODE && !this.usedFreshTicket);
    if (!this.isEnded) {
      this.retryTimer = setTimeout(() => this.connect(), this.retryDelay);
      this.retryDelay = Math.min(this.retryDelay * 2, MAX_RETRY_DELAY_MS);
    }
    this.options.onClosed(reason, this.isEnded);
  }

  private describeClose(code: number, serverReason: string): string {
    const { translate, translateServerText } = this.translator;
    if (serverReason) return translateServerText(serverReason);
    return code in CLOSE_REASONS ? translate(CLOSE_REASONS[code]) : translate("closed with code {code}", { code });
  }
}
