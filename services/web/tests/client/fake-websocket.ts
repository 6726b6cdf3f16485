/** Fake of the browser's WebSocket; the test plays the server. */

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

  /** WebSocket that was opened last. */
  static get last(): FakeWebSocket {
    return FakeWebSocket.opened[FakeWebSocket.opened.length - 1];
  }

  /** Replace the browser's WebSocket, and use fake timers. */
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

  /** Open the connection. */
  accept(): void {
    this.readyState = 1;
    this.dispatchEvent(new Event("open"));
  }

  /** Receive messages from the server. */
  receive(...messages: Message[]): void {
    for (const message of messages) this.receiveRaw(pack(message));
  }

  /** Receive bytes or text from the server. */
  receiveRaw(data: Uint8Array<ArrayBuffer> | string): void {
    const payload = typeof data === "string" ? data : data.slice().buffer;
    this.dispatchEvent(new MessageEvent("message", { data: payload }));
  }

  /** Close the connection from the server's side. */
  endWith(code: number, reason = ""): void {
    this.readyState = 3;
    this.dispatchEvent(Object.assign(new Event("close"), { code, reason }));
  }

  /** Return the sent messages with this name. */
  messagesOf<Name extends Message["name"]>(name: Name): Extract<Message, { name: Name }>[] {
    return this.sent.filter((message): message is Extract<Message, { name: Name }> => message.name === name);
  }
}
