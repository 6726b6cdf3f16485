/** A puppeteer with the limbs of several performers in hand. */

import { afterEach, beforeEach, describe, expect, test } from "vitest";
import { createMarionetteSolver } from "../../src/client/marionette-solver";
import type { Puppeteer } from "../../src/client/puppeteer";
import type { Viewer } from "../../src/client/viewer";
import { copyPose, type Pose, restPose } from "../../src/motion/skeleton";
import { goldenDescription } from "../golden-motion";
import { table } from "../marionette/figure";
import { advanceTime, endControlSession, now, startControlSession } from "./control-session";
import type { FakeWebSocket } from "./fake-websocket";

const free = (limbs: number) => Array.from({ length: limbs }, () => null);
const nobody = (limbs: number): string[][] => Array.from({ length: limbs }, () => []);

let viewer: Viewer;
let stream: FakeWebSocket;
let puppeteer: Puppeteer;
let line: FakeWebSocket;
let told: unknown[];

beforeEach(async () => {
  ({
    viewer,
    viewerSocket: stream,
    puppeteer,
    socket: line,
  } = await startControlSession([goldenDescription(), { ...goldenDescription(), place: [1, -2, 2.5] }]));
  told = [];
  for (const name of ["grant", "lapsed", "refusal"])
    puppeteer.addEventListener(name, (event) => told.push([name, (event as CustomEvent).detail]));
});

afterEach(() => endControlSession({ viewer, viewerSocket: stream, puppeteer, socket: line }));

/** Both poses as drawn now. */
function poses(): Pose[] {
  return [0, 1].map((performer) => {
    const pose = restPose();
    copyPose(viewer.poseAt(now, performer)!, pose);
    return pose;
  });
}

/** Draws `ms` milliseconds, 60 frames a second. */
function draw(ms: number): Pose[] {
  for (let passed = 0; passed < ms; passed += 1000 / 60) {
    advanceTime(1000 / 60);
    poses();
  }
  return poses();
}

/** Where the limb of its performer's pose is as drawn now. */
function drawn(limb: number): number[] {
  const one = createMarionetteSolver(viewer.performers[limb >> 2]!.figure, [table, table]).limbs[limb & 3];
  one.observePose(viewer.poseAt(now, limb >> 2)!.rotations, 0);
  return [...one.position];
}

test("every limb is known from the start, and none is held or asked for", () => {
  for (let limb = 0; limb < 16; limb++)
    expect([puppeteer.holds(limb), puppeteer.isAsking(limb)]).toEqual([false, false]);
  advanceTime(1_000);
  expect(line.sent).toEqual([]);
});

test("a limb of another performer is claimed, moved, kept alive and let go by its number", () => {
  puppeteer.claim(6);
  line.receive({ name: "Grant", limb: 6, epoch: 4 });
  expect([puppeteer.holds(6), puppeteer.holds(2)]).toEqual([true, false]);
  puppeteer.target(6, 0.75, 0, 0);
  expect(line.messagesOf("Input")).toMatchObject([{ limb: 6, kind: 1, epoch: 4, sequence: 0, values: [0.75, 0, 0] }]);
  advanceTime(120);
  expect(line.messagesOf("Alive").at(-1)).toEqual({ name: "Alive", limbs: [6] });
  // a leg goes by its first number alone, and at its own speed
  puppeteer.velocity(6, 0.5, 0, 0);
  advanceTime(100);
  puppeteer.velocity(6, 0, 0, 0);
  expect(line.messagesOf("Input").at(-1)!.values[0]).toBeCloseTo(0.75 + 0.1, 6);
  puppeteer.release(6);
  expect([line.messagesOf("Claim"), line.messagesOf("Release")]).toEqual([
    [{ name: "Claim", limb: 6 }],
    [{ name: "Release", limb: 6, epoch: 4 }],
  ]);
});

describe("one's own limb of another performer", () => {
  test("is shown at once, where the dancer stands, and the first dances on bit for bit", () => {
    const [first, second] = poses();
    puppeteer.claim(4);
    puppeteer.target(4, 0.5, -0.3, 0.4);
    const after = draw(600);
    [0.5, -0.3, 0.4].forEach((value, axis) => expect(drawn(4)[axis]).toBeCloseTo(value, 6));
    expect(after[0]).toEqual(first);
    expect(after[1].root).toEqual(second.root);
    expect(after[1].rotations.subarray(0, 48)).toEqual(second.rotations.subarray(0, 48));
    expect(after[1].rotations.subarray(60)).toEqual(second.rotations.subarray(60));
  });

  test("and the same one of the first go each their own way", () => {
    puppeteer.claim(0);
    puppeteer.claim(4);
    puppeteer.target(0, 0.2, -0.6, 0.3);
    puppeteer.target(4, 0.5, -0.3, 0.4);
    draw(600);
    [0.2, -0.6, 0.3].forEach((value, axis) => expect(drawn(0)[axis]).toBeCloseTo(value, 6));
    [0.5, -0.3, 0.4].forEach((value, axis) => expect(drawn(4)[axis]).toBeCloseTo(value, 6));
  });

  test("is what everyone sees while Presence has it in another's hands", () => {
    const before = poses();
    line.receive({
      name: "Presence",
      viewers: 2,
      puppeteers: [],
      limbs: [null, null, null, null, "b2", null, null, null],
      asks: nobody(8),
    });
    puppeteer.claim(4);
    puppeteer.target(4, 0.5, -0.3, 0.4);
    expect(draw(200)).toEqual(before);
    line.receive({ name: "Grant", limb: 4, epoch: 3 });
    draw(600);
    expect(drawn(4)[0]).toBeCloseTo(0.5, 6);
  });
});

describe("as the motion changes to one of fewer performers", () => {
  test("what is not there any more is refused, and dropped", () => {
    puppeteer.claim(7);
    line.receive({ name: "Grant", limb: 7, epoch: 1 }, { name: "Refusal", limb: 7, reason: "lost", holder: null });
    expect(line.messagesOf("Claim")).toHaveLength(2);
    line.receive({ name: "Refusal", limb: 7, reason: "unknown", holder: null });
    puppeteer.target(7, 0.5, 0, 0);
    advanceTime(200);
    expect([puppeteer.holds(7), line.messagesOf("Input"), line.messagesOf("Claim").length]).toEqual([false, [], 2]);
    expect(told).toEqual([
      ["grant", { limb: 7, asked: false }],
      ["refusal", { limb: 7, reason: "unknown", holder: null }],
    ]);
  });

  test("Presence has fewer limbs: what was asked for lapses, and is not free", () => {
    line.receive({
      name: "Presence",
      viewers: 2,
      puppeteers: [],
      limbs: [...free(4), "b2", ...free(3)],
      asks: nobody(8),
    });
    puppeteer.ask(4);
    line.receive({
      name: "Presence",
      viewers: 2,
      puppeteers: [],
      limbs: [...free(4), "b2", ...free(3)],
      asks: [...nobody(4), ["a1"], ...nobody(3)],
    });
    expect(puppeteer.isAsking(4)).toBe(true);
    line.receive({ name: "Presence", viewers: 2, puppeteers: [], limbs: free(4), asks: nobody(4) });
    expect([puppeteer.isAsking(4), told]).toEqual([false, [["lapsed", { limb: 4, free: false }]]]);
    // one that Presence never told of lapses as soon
    puppeteer.ask(5);
    line.receive({ name: "Presence", viewers: 2, puppeteers: [], limbs: free(4), asks: nobody(4) });
    expect([puppeteer.isAsking(5), told[1]]).toEqual([false, ["lapsed", { limb: 5, free: false }]]);
    // nobody has it any more
    const before = drawn(4);
    puppeteer.claim(4);
    puppeteer.target(4, 0.5, -0.3, 0.4);
    draw(100);
    expect(drawn(4)).not.toEqual(before);
  });
});
