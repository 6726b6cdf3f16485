/** Viewer on fake WebSockets and a local clock, and the messages of its server. */
import { afterEach, beforeEach, expect, vi } from "vitest";
import { Viewer } from "../../src/client/viewer";
import type { Message, TimelineState } from "../../src/wire/messages";
import { type BlockVectors, goldenDescription } from "../golden-motion";
import { decodeBase64, loadVectors } from "../golden-vectors";
import { FakeWebSocket } from "./fake-websocket";

export const EPOCH_US = 1_774_000_000_000_000;
export const SESSION = "ws://stage/v1/sessions/s1/stream";
export const MOTION = "ws://stage/v1/motions/dance/stream?rate=1";
const golden = loadVectors<BlockVectors>("blocks").valid;
export const [best, lowest, , last] = golden.map((vector) => decodeBase64(vector.block));

/** Local milliseconds. */
export let now = 0;
/** Number of pings that were answered. */
let answeredCount = 0;
export let viewer: Viewer;

/** Give each test of the calling file its own sockets, time and viewer. */
export function isolateViewers(): void {
  beforeEach(() => {
    FakeWebSocket.install();
    now = answeredCount = 0;
  });
  afterEach(() => {
    viewer.close();
    FakeWebSocket.remove();
  });
}

/** Advance the local clock and the timers. */
export function advanceTime(ms: number): void {
  now += ms;
  vi.advanceTimersByTime(ms);
}

export function header(motion = "dance"): Message {
  return {
    name: "ChannelHeader",
    motion,
    now: EPOCH_US + now * 1000,
    channels: 19,
    software: "0",
    version: 1,
    clock: "unix",
  };
}

export function description(motion = "dance"): Message {
  return { name: "Description", motion, first: null, tracks: [{ type: "song" }, goldenDescription()] };
}

export function timeline(change: Partial<TimelineState> = {}): Message {
  return {
    name: "TimelineState",
    epoch: 1,
    motion: "dance",
    clock: EPOCH_US,
    position: 0,
    playing: true,
    loop: true,
    duration: 2_600_000,
    ...change,
  };
}

export function data(index: number, rate: number, block: Uint8Array): Message {
  return { name: "Data", track: 1, rate, index, block };
}

/** Advance time; the server answers each ping after 40 ms. */
export function advanceTimeAnswered(ms: number): void {
  for (const end = now + ms; now < end; ) {
    advanceTime(Math.min(20, end - now));
    for (const { sequence, sent } of FakeWebSocket.last.messagesOf("Ping")) {
      if (sequence < answeredCount || now * 1000 - sent < 40_000) continue;
      answeredCount = sequence + 1;
      FakeWebSocket.last.receive({
        name: "Pong",
        sequence,
        sent,
        received: EPOCH_US + sent + 20_000,
        answered: EPOCH_US + sent + 20_000,
      });
    }
  }
}

/** Open a viewer whose connection is not established. */
export function createViewer(url = SESSION): void {
  viewer = new Viewer({ url, now: () => now, solver: null });
}

/** Open a viewer that received the header, the description and a timeline that starts now. */
export function openViewer(url = SESSION): void {
  createViewer(url);
  FakeWebSocket.last.accept();
  FakeWebSocket.last.receive(header(), description(), timeline());
}

export function expectNear(actual: Float64Array, expected: Float64Array): void {
  expected.forEach((value, i) => expect(Math.abs(actual[i] - value)).toBeLessThan(1e-9));
}
