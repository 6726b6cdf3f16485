/** A line in a test's hands: it stands where the browser's WebSocket would, and the test is the server at its other end. */

import { vi } from "vitest";
import { pack, unpack } from "../../src/wire/codec";
import type { Message } from "../../src/wire/messages";

export class FakeWebSocket extends EventTarget {
  static opened: FakeWebSocket[] = [];
  readyState = 0;
  bufferedAmount = 0;
  binaryType = "blob";
  readonly sent: Message[] = [];

  constructor(
    readonly url: string,
    readonly protocol: string,
  ) {
    super();
    FakeWebSocket.opened.push(this);
  }

  /** The line opened last. */
  static get last(): FakeWebSocket {
    return FakeWebSocket.opened[FakeWebSocket.opened.length - 1];
  }

  /** Puts lines in the place of WebSockets; times are vitest's. */
  static install(): void {
    FakeWebSocket.opened = [];
    vi.useFakeTimers();
    vi.stubGlobal("WebSocket", FakeWebSocket);
  }

  static remove(): void {
    vi.unstubAllGlobals();
    vi.useRealTimers();
  }

  send(data: Uint8Array): void {
    const message = unpack(data);
    if (message) this.sent.push(message);
  }

  close(): void {
    this.readyState = 3;
  }

  /** The server accepts. */
  accept(): void {
    this.readyState = 1;
    this.dispatchEvent(new Event("open"));
  }

  /** The server says something. */
  receive(...messages: Message[]): void {
    for (const message of messages) this.receiveRaw(pack(message));
  }

  /** The server sends bytes, or text. */
  receiveRaw(data: Uint8Array<ArrayBuffer> | string): void {
    const sent = typeof data === "string" ? data : data.slice().buffer;
    this.dispatchEvent(new MessageEvent("message", { data: sent }));
  }

  /** The line ends. */
  endWith(code: number, reason = ""): void {
    this.readyState = 3;
    this.dispatchEvent(Object.assign(new Event("close"), { code, reason }));
  }

  /** What was sent of one kind. */
  messagesOf<Name extends Message["name"]>(name: Name): Extract<Message, { name: Name }>[] {
    return this.sent.filter((message): message is Extract<Message, { name: Name }> => message.name === name);
  }
}
