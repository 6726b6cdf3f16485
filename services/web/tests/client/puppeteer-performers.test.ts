/** Puppeteer with limbs of several performers. */

import { afterEach, beforeEach, describe, expect, test } from "vitest";
import { createMarionetteSolver } from "../../src/client/marionette-solver";
import type { PerformerView } from "../../src/client/performer-view";
import type { Puppeteer } from "../../src/client/puppeteer";
import type { Viewer } from "../../src/client/viewer";
import { copyPose, type Pose, restPose } from "../../src/motion/skeleton";
import { goldenDescription } from "../golden-motion";
import { table } from "../marionette/figure";
import { advanceTime, endControlSession, now, startControlSession } from "./control-session";
import type { FakeWebSocket } from "./fake-websocket";

const unheld = (limbs: number): (string | null)[] => Array.from({ length: limbs }, () => null);
const noAsks = (limbs: number): string[][] => Array.from({ length: limbs }, () => []);

let viewer: Viewer;
let viewerSocket: FakeWebSocket;
let puppeteer: Puppeteer;
let socket: FakeWebSocket;
let events: unknown[];

beforeEach(async () => {
  ({ viewer, viewerSocket, puppeteer, socket } = await startControlSession([
    goldenDescription(),
    { ...goldenDescription(), place: [1, -2, 2.5] },
  ]));
  events = [];
  for (const name of ["grant", "lapsed", "refusal"])
    puppeteer.addEventListener(name, (event) => events.push([name, (event as CustomEvent).detail]));
});

afterEach(() => endControlSession({ viewer, viewerSocket, puppeteer, socket }));

/** Receive who holds each limb, and who asks for it. */
function receivePresence(limbs: (string | null)[], asks = noAsks(limbs.length)): void {
  socket.receive({
    name: "Presence",
    live: null,
    bonds: null,
    crowd: null,
    props: null,
    viewers: 2,
    puppeteers: [],
    limbs,
    asks,
  });
}

/** Return the current poses of both performers. */
function currentPoses(): Pose[] {
  return [0, 1].map((performer) => {
    const pose = restPose();
    copyPose(viewer.poseAt(now, performer)!, pose);
    return pose;
  });
}

/** Draw for `ms` milliseconds at 60 frames per second; return the last poses. */
function draw(ms: number): Pose[] {
  for (let passed = 0; passed < ms; passed += 1000 / 60) {
    advanceTime(1000 / 60);
    currentPoses();
  }
  return currentPoses();
}

/** Return the position of a limb in its performer's current pose. */
function tipPosition(limb: number): number[] {
  const controlled = createMarionetteSolver(viewer.performers[limb >> 2]!.figure, [table, table]).limbs[limb & 3];
  controlled.observePose(viewer.poseAt(now, limb >> 2)!.rotations, 0);
  return [...controlled.position];
}

test("limbs are neither held nor requested at the start", () => {
  for (let limb = 0; limb < 16; limb++)
    expect([puppeteer.holds(limb), puppeteer.isAsking(limb)]).toEqual([false, false]);
  advanceTime(1_000);
  expect(socket.sent).toEqual([]);
});

test("limb of another performer is claimed, moved, kept alive and released", () => {
  puppeteer.claim(6);
  socket.receive({ name: "Grant", limb: 6, epoch: 4 });
  expect([puppeteer.holds(6), puppeteer.holds(2)]).toEqual([true, false]);
  puppeteer.target(6, 0.75, 0, 0);
  expect(socket.messagesOf("Input")).toMatchObject([{ limb: 6, kind: 1, epoch: 4, sequence: 0, values: [0.75, 0, 0] }]);
  advanceTime(120);
  expect(socket.messagesOf("Alive").at(-1)).toEqual({ name: "Alive", limbs: [6] });
  // a leg uses the first value only, and its own full speed
  puppeteer.velocity(6, 0.5, 0, 0);
  advanceTime(100);
  puppeteer.velocity(6, 0, 0, 0);
  expect(socket.messagesOf("Input").at(-1)!.values[0]).toBeCloseTo(0.75 + 0.1, 6);
  puppeteer.release(6);
  expect([socket.messagesOf("Claim"), socket.messagesOf("Release")]).toEqual([
    [{ name: "Claim", limb: 6 }],
    [{ name: "Release", limb: 6, epoch: 4 }],
  ]);
});

describe("own limb of another performer", () => {
  test("is predicted, and the first performer is unchanged bit for bit", () => {
    const [first, second] = currentPoses();
    puppeteer.claim(4);
    puppeteer.target(4, 0.5, -0.3, 0.4);
    const after = draw(600);
    [0.5, -0.3, 0.4].forEach((value, axis) => expect(tipPosition(4)[axis]).toBeCloseTo(value, 6));
    expect(after[0]).toEqual(first);
    expect(after[1].root).toEqual(second.root);
    expect(after[1].rotations.subarray(0, 48)).toEqual(second.rotations.subarray(0, 48));
    expect(after[1].rotations.subarray(60)).toEqual(second.rotations.subarray(60));
  });

  test("counts as controlled, also without overlays of the session, until it is back in the motion", () => {
    const controlled = () => viewer.performers.map((performer) => (performer as PerformerView).controlledLimbs);
    currentPoses();
    expect(controlled()).toEqual([0, 0]);
    puppeteer.claim(6);
    puppeteer.target(6, 0.5, 0, 0);
    draw(300);
    expect(controlled()).toEqual([0, 0b100]);
    puppeteer.release(6);
    draw(3_000);
    expect(controlled()).toEqual([0, 0]);
  });

  test("and the same limb of the first move independently", () => {
    puppeteer.claim(0);
    puppeteer.claim(4);
    puppeteer.target(0, 0.2, -0.6, 0.3);
    puppeteer.target(4, 0.5, -0.3, 0.4);
    draw(600);
    [0.2, -0.6, 0.3].forEach((value, axis) => expect(tipPosition(0)[axis]).toBeCloseTo(value, 6));
    [0.5, -0.3, 0.4].forEach((value, axis) => expect(tipPosition(4)[axis]).toBeCloseTo(value, 6));
  });

  test("is shown as the session sends it while another puppeteer holds it", () => {
    const before = currentPoses();
    receivePresence([...unheld(4), "b2", ...unheld(3)]);
    puppeteer.claim(4);
    puppeteer.target(4, 0.5, -0.3, 0.4);
    expect(draw(200)).toEqual(before);
    socket.receive({ name: "Grant", limb: 4, epoch: 3 });
    draw(600);
    expect(tipPosition(4)[0]).toBeCloseTo(0.5, 6);
  });
});

describe("change to a motion with fewer performers", () => {
  test("releases a limb that is refused as unknown", () => {
    puppeteer.claim(7);
    socket.receive({ name: "Grant", limb: 7, epoch: 1 }, { name: "Refusal", limb: 7, reason: "lost", holder: null });
    expect(socket.messagesOf("Claim")).toHaveLength(2);
    socket.receive({ name: "Refusal", limb: 7, reason: "unknown", holder: null });
    puppeteer.target(7, 0.5, 0, 0);
    advanceTime(200);
    expect([puppeteer.holds(7), socket.messagesOf("Input"), socket.messagesOf("Claim").length]).toEqual([false, [], 2]);
    expect(events).toEqual([
      ["grant", { limb: 7, asked: false }],
      ["refusal", { limb: 7, reason: "unknown", holder: null }],
    ]);
  });

  test("ends requests for removed limbs, not as free", () => {
    receivePresence([...unheld(4), "b2", ...unheld(3)]);
    puppeteer.ask(4);
    receivePresence([...unheld(4), "b2", ...unheld(3)], [...noAsks(4), ["a1"], ...noAsks(3)]);
    expect(puppeteer.isAsking(4)).toBe(true);
    receivePresence(unheld(4));
    expect([puppeteer.isAsking(4), events]).toEqual([false, [["lapsed", { limb: 4, free: false }]]]);
    // a request that Presence never listed lapses, too
    puppeteer.ask(5);
    receivePresence(unheld(4));
    expect([puppeteer.isAsking(5), events[1]]).toEqual([false, ["lapsed", { limb: 5, free: false }]]);
    // no puppeteer holds it any more
    const before = tipPosition(4);
    puppeteer.claim(4);
    puppeteer.target(4, 0.5, -0.3, 0.4);
    draw(100);
    expect(tipPosition(4)).not.toEqual(before);
  });
});
