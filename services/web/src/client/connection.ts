/** A WebSocket of `bunraku.v1` that comes back by itself when it is lost. */

import { pack, unpack } from "../wire/codec";
import { MalformedMessage } from "../wire/errors";
import { type ClientMessage, type Message, SUBPROTOCOL } from "../wire/messages";

const FIRST_WAIT = 250;
const LONGEST_WAIT = 4_000;

/** Closes after which to come again would help nobody: done, contract broken, too large, not there, not spoken here. */
const FINAL = new Set([1000, 1008, 1009, 4404, 4406]);

/** Plain words for closes that bring none of their own. */
const REASONS: Readonly<Record<number, string>> = {
  1000: "the server has ended it",
  1006: "the line was lost",
  1011: "the server failed",
  1012: "the server restarts",
  1013: "the server is too busy",
  4404: "there is no such motion or session",
  4406: "the server speaks another version",
};

export interface ConnectionOptions {
  /** Where to; asked before every attempt. */
  url: () => string;
  onOpen: () => void;
  onMessage: (message: Message, bytes: number) => void;
  /** A message that could not be read; the connection goes on. */
  onMalformed: (error: MalformedMessage) => void;
  /** The line is gone; `final` where it will not be tried again. */
  onClosed: (reason: string, final: boolean) => void;
}

export class Connection {
  private socket: WebSocket | null = null;
  private wait = FIRST_WAIT;
  private timer: ReturnType<typeof setTimeout> | undefined;
  private problem: string | null = null;
  private ended = false;

  constructor(private readonly options: ConnectionOptions) {
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
    return true;
  }

  /** Ends it for good. */
  close(reason = "closed here"): void {
    if (this.ended) return;
    this.ended = true;
    clearTimeout(this.timer);
    const { socket } = this;
    this.socket = null;
    socket?.close(1000);
    this.options.onClosed(reason, true);
  }

  private connect(): void {
    this.problem = null;
    const socket = new WebSocket(this.options.url(), SUBPROTOCOL);
    socket.binaryType = "arraybuffer";
    this.socket = socket;
    socket.addEventListener("open", () => {
      if (socket === this.socket) this.options.onOpen();
    });
    socket.addEventListener("message", (event: MessageEvent<ArrayBuffer | string>) => {
      if (socket === this.socket) this.receive(event.data);
    });
    socket.addEventListener("close", (event) => {
      if (socket === this.socket) this.lost(event.code, event.reason);
    });
  }

  private receive(data: ArrayBuffer | string): void {
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
    if (message.name === "Problem") this.problem = `${message.title}: ${message.detail}`;
    this.options.onMessage(message, data.byteLength);
  }

  private lost(code: number, said: string): void {
    this.socket = null;
    const reason = this.problem ?? (said || (REASONS[code] ?? `closed with code ${code}`));
    this.ended = FINAL.has(code);
    if (!this.ended) {
      this.timer = setTimeout(() => this.connect(), this.wait);
      this.wait = Math.min(this.wait * 2, LONGEST_WAIT);
    }
    this.options.onClosed(reason, this.ended);
  }
}
