/** Session with a viewer and a puppeteer, over fake WebSockets. */

import { vi } from "vitest";
import { createMarionetteSolver } from "../../src/client/marionette-solver";
import { Puppeteer } from "../../src/client/puppeteer";
import { Viewer } from "../../src/client/viewer";
import type { Track } from "../../src/wire/messages";
import type { BlockVectors } from "../golden-motion";
import { decodeBase64, loadVectors } from "../golden-vectors";
import { table } from "../marionette/figure";
import { FakeWebSocket } from "./fake-websocket";

export const EPOCH_US = 1_774_000_000_000_000;
const [block] = loadVectors<BlockVectors>("blocks").valid.map((vector) => decodeBase64(vector.block));

/** Local milliseconds. */
export let now = 0;

export interface ControlSession {
  viewer: Viewer;
  viewerSocket: FakeWebSocket;
  puppeteer: Puppeteer;
  socket: FakeWebSocket;
}

/** Start a paused session with the performers of `tracks`, each shown, and a connected puppeteer. */
export async function startControlSession(tracks: readonly Track[]): Promise<ControlSession> {
  FakeWebSocket.install();
  now = 0;
  const viewer = new Viewer({
    url: "ws://stage/v1/sessions/s/stream",
    now: () => now,
    solver: (figure) => createMarionetteSolver(figure, [table, table]),
  });
  const viewerSocket = FakeWebSocket.last;
  viewerSocket.accept();
  viewerSocket.receive(
    {
      name: "ChannelHeader",
      motion: "d",
      now: EPOCH_US,
      channels: 19 * tracks.length,
      software: "0",
      version: 1,
      clock: "unix",
    },
    { name: "Description", motion: "d", first: null, tracks: [...tracks] },
    {
      name: "TimelineState",
      epoch: 1,
      motion: "d",
      clock: EPOCH_US,
      position: 0,
      playing: false,
      loop: true,
      duration: 2_600_000,
    },
    ...tracks.map((_, track) => ({ name: "Data" as const, track, rate: 1, index: 0, block })),
  );
  // the solvers are created asynchronously after the first pose
  tracks.forEach((_, performer) => viewer.poseAt(now, performer));
  await vi.advanceTimersByTimeAsync(0);
  const puppeteer = new Puppeteer({ url: "ws://stage/v1/sessions/s/control", viewer, now: () => now });
  const socket = FakeWebSocket.last;
  viewer.attach(puppeteer);
  socket.accept();
  socket.receive({ name: "Welcome", id: "a1", colour: 2, lead: 100_000 });
  return { viewer, viewerSocket, puppeteer, socket };
}

export function endControlSession({ puppeteer, viewer }: ControlSession): void {
  puppeteer.close();
  viewer.close();
  FakeWebSocket.remove();
}

export function advanceTime(ms: number): void {
  now += ms;
  vi.advanceTimersByTime(ms);
}
