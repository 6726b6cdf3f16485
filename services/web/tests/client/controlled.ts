/** A session under a puppeteer's control, over lines of the test's own. */
import { vi } from "vitest";
import { marionette } from "../../src/client/marionette";
import { Puppeteer } from "../../src/client/puppeteer";
import { Viewer } from "../../src/client/viewer";
import type { Track } from "../../src/wire/messages";
import { type BlockVectors } from "../golden";
import { table } from "../marionette/figure";
import { bytes, vectors } from "../vectors";
import { Line } from "./line";

export const UNIX = 1_774_000_000_000_000;
const [block] = vectors<BlockVectors>("blocks").valid.map((vector) => bytes(vector.block));

/** Local milliseconds. */
export let now = 0;

export interface Controlled {
  viewer: Viewer;
  stream: Line;
  puppeteer: Puppeteer;
  line: Line;
}

/** Begins with a paused dance of performers that these tracks describe, each seen, and a puppeteer who is welcome. */
export async function begin(tracks: readonly Track[]): Promise<Controlled> {
  Line.install();
  now = 0;
  const viewer = new Viewer({ url: "ws://stage/v1/sessions/s/stream", now: () => now, solver: (figure) => marionette(figure, [table, table]) });
  const stream = Line.last;
  stream.accept();
  stream.say(
    { name: "ChannelHeader", motion: "d", now: UNIX, channels: 19 * tracks.length, software: "0", version: 1, clock: "unix" },
    { name: "Description", motion: "d", first: null, tracks: [...tracks] },
    { name: "TimelineState", epoch: 1, motion: "d", clock: UNIX, position: 0, playing: false, loop: true, duration: 2_600_000 },
    ...tracks.map((_, track) => ({ name: "Data" as const, track, rate: 1, index: 0, block })),
  );
  // the solvers are made from the first pose on, in their own time
  tracks.forEach((_, performer) => viewer.poseAt(now, performer));
  await vi.advanceTimersByTimeAsync(0);
  const puppeteer = new Puppeteer({ url: "ws://stage/v1/sessions/s/control", viewer, now: () => now });
  const line = Line.last;
  viewer.attach(puppeteer);
  line.accept();
  line.say({ name: "Welcome", id: "a1", colour: 2, lead: 100_000 });
  return { viewer, stream, puppeteer, line };
}

export function end({ puppeteer, viewer }: Controlled): void {
  puppeteer.close();
  viewer.close();
  Line.remove();
}

export function pass(ms: number): void {
  now += ms;
  vi.advanceTimersByTime(ms);
}
