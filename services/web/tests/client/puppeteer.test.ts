import { afterEach, beforeEach, describe, expect, test } from "vitest";
import { createMarionetteSolver } from "../../src/client/marionette-solver";
import type { Puppeteer } from "../../src/client/puppeteer";
import type { Viewer } from "../../src/client/viewer";
import { goldenDescription } from "../golden-motion";
import { table } from "../marionette/figure";
import { advanceTime, EPOCH_US, endControlSession, now, startControlSession } from "./control-session";
import { FakeWebSocket } from "./fake-websocket";

let viewer: Viewer;
let viewerSocket: FakeWebSocket;
let puppeteer: Puppeteer;
let socket: FakeWebSocket;

beforeEach(async () => {
  ({ viewer, viewerSocket, puppeteer, socket } = await startControlSession([goldenDescription()]));
});

afterEach(() => endControlSession({ viewer, viewerSocket, puppeteer, socket }));

/** Return the position of the left hand in the current pose. */
function tipPosition(): number[] {
  const [hand] = createMarionetteSolver(viewer.figure!, [table, table]).limbs;
  hand.observePose(viewer.poseAt(now)!.rotations, 0);
  return [...hand.position];
}

/** Draw for `ms` milliseconds at 60 frames per second. */
function draw(ms: number): void {
  for (let passed = 0; passed < ms; passed += 1000 / 60) {
    advanceTime(1000 / 60);
    viewer.poseAt(now);
  }
}

function distance(a: number[], b: number[]): number {
  return Math.hypot(...a.map((value, axis) => value - b[axis]));
}

test("welcome sets id and colour", () => {
  expect([puppeteer.id, puppeteer.colour]).toEqual(["a1", 2]);
  expect(puppeteer.limits).toMatchObject({ reach: 1, handSpeed: 1, legSpeed: 2 });
});

test("replacement of the viewer's connection starts one here and reclaims limbs", () => {
  puppeteer.claim(0);
  socket.receive({ name: "Grant", limb: 0, epoch: 3 });
  viewer.dispatchEvent(new Event("replaced"));
  const replacement = FakeWebSocket.last;
  expect(replacement).not.toBe(socket);
  replacement.accept();
  expect(puppeteer.id).toBe("a1");
  replacement.receive({ name: "Welcome", id: "b2", colour: 3, lead: 100_000 });
  expect([puppeteer.id, socket.readyState]).toEqual(["b2", 3]);
  expect(replacement.messagesOf("Claim")).toEqual([{ name: "Claim", limb: 0 }]);
  puppeteer.close();
  const count = FakeWebSocket.opened.length;
  viewer.dispatchEvent(new Event("replaced"));
  expect(FakeWebSocket.opened).toHaveLength(count);
});

describe("limb", () => {
  test("is claimed, granted and released with its epoch", () => {
    const granted: unknown[] = [];
    puppeteer.addEventListener("grant", (event) => granted.push((event as CustomEvent).detail));
    puppeteer.claim(1);
    puppeteer.claim(1);
    expect(socket.messagesOf("Claim")).toEqual([{ name: "Claim", limb: 1 }]);
    expect(puppeteer.holds(1)).toBe(false);
    socket.receive({ name: "Grant", limb: 1, epoch: 7 });
    expect(granted).toEqual([{ limb: 1, asked: false }]);
    expect(puppeteer.holds(1)).toBe(true);
    puppeteer.release(1);
    expect(socket.messagesOf("Release")).toEqual([{ name: "Release", limb: 1, epoch: 7 }]);
    expect(puppeteer.holds(1)).toBe(false);
  });

  test("released before the grant is released again on the grant", () => {
    puppeteer.claim(0);
    puppeteer.release(0);
    expect(socket.messagesOf("Release")).toEqual([]);
    socket.receive({ name: "Grant", limb: 0, epoch: 3 });
    expect(socket.messagesOf("Release")).toEqual([{ name: "Release", limb: 0, epoch: 3 }]);
    expect(puppeteer.holds(0)).toBe(false);
  });

  test("that is refused sends no input and reports the reason", () => {
    const refused: unknown[] = [];
    puppeteer.addEventListener("refusal", (event) => refused.push((event as CustomEvent).detail));
    puppeteer.claim(0);
    socket.receive({ name: "Refusal", limb: 0, reason: "held", holder: "b2" });
    puppeteer.target(0, 1, 0, 0);
    advanceTime(100);
    expect(refused).toEqual([{ limb: 0, reason: "held", holder: "b2" }]);
    expect(socket.messagesOf("Input")).toEqual([]);
  });

  test("lost while held is claimed again unless another puppeteer has it", () => {
    const refused: unknown[] = [];
    puppeteer.addEventListener("refusal", (event) => refused.push((event as CustomEvent).detail));
    puppeteer.claim(0);
    socket.receive({ name: "Grant", limb: 0, epoch: 3 });
    puppeteer.target(0, 0.5, 0, 0);
    socket.receive({ name: "Refusal", limb: 0, reason: "lost", holder: null });
    expect(socket.messagesOf("Claim")).toHaveLength(2);
    expect([puppeteer.holds(0), refused]).toEqual([false, []]);
    socket.receive({ name: "Grant", limb: 0, epoch: 4 });
    expect(puppeteer.holds(0)).toBe(true);
    // the session receives the position again
    expect(socket.messagesOf("Input").at(-1)).toMatchObject({ epoch: 4, values: [0.5, 0, 0] });
    socket.receive(
      { name: "Refusal", limb: 0, reason: "lost", holder: null },
      { name: "Refusal", limb: 0, reason: "held", holder: "b2" },
    );
    expect(refused).toEqual([{ limb: 0, reason: "held", holder: "b2" }]);
  });

  test("lost after the release is not claimed again", () => {
    puppeteer.claim(0);
    socket.receive({ name: "Grant", limb: 0, epoch: 3 });
    puppeteer.release(0);
    socket.receive({ name: "Refusal", limb: 0, reason: "lost", holder: null });
    expect(socket.messagesOf("Claim")).toHaveLength(1);
  });

  test("is claimed again after a reconnect", () => {
    puppeteer.claim(0);
    socket.receive({ name: "Grant", limb: 0, epoch: 3 });
    socket.endWith(1006);
    expect(puppeteer.holds(0)).toBe(false);
    advanceTime(250);
    socket = FakeWebSocket.last;
    socket.accept();
    socket.receive({ name: "Welcome", id: "a9", colour: 0, lead: 100_000 });
    expect(socket.messagesOf("Claim")).toEqual([{ name: "Claim", limb: 0 }]);
  });
});

describe("a bond of two hands", () => {
  const presence = (bonds: number[][] | null) =>
    socket.receive({
      name: "Presence",
      live: null,
      bonds,
      crowd: null,
      props: null,
      viewers: 1,
      puppeteers: [],
      limbs: ["a1", null, null, null],
      asks: [[], [], [], []],
    });

  test("is requested and ended, and its state follows the session", () => {
    puppeteer.bond(0, 1);
    expect(socket.messagesOf("Bond")).toEqual([{ name: "Bond", limbs: [0, 1], wanted: true }]);
    expect([puppeteer.isBonded(0), puppeteer.bonds]).toEqual([false, []]);
    presence([[0, 1]]);
    expect([puppeteer.isBonded(1), puppeteer.isBonded(2), puppeteer.bonds]).toEqual([true, false, [[0, 1]]]);
    puppeteer.unbond(0, 1);
    expect(socket.messagesOf("Bond").at(-1)?.wanted).toBe(false);
    presence(null);
    expect(puppeteer.isBonded(0)).toBe(false);
  });

  test("is requested again after a reconnect, once its hands are granted again", () => {
    for (const limb of [0, 1]) {
      puppeteer.claim(limb);
      socket.receive({ name: "Grant", limb, epoch: 3 });
    }
    puppeteer.bond(1, 0);
    presence([[0, 1]]);
    socket.endWith(1006);
    advanceTime(250);
    socket = FakeWebSocket.last;
    socket.accept();
    socket.receive({ name: "Welcome", id: "a9", colour: 0, lead: 100_000 });
    presence(null);
    socket.receive({ name: "Grant", limb: 0, epoch: 4 });
    expect(socket.messagesOf("Bond")).toEqual([]);
    socket.receive({ name: "Grant", limb: 1, epoch: 4 });
    expect(socket.messagesOf("Bond")).toEqual([{ name: "Bond", limbs: [0, 1], wanted: true }]);
  });

  test("is requested again on a connection that replaces another", () => {
    puppeteer.claim(0);
    socket.receive({ name: "Grant", limb: 0, epoch: 3 });
    puppeteer.bond(0, 1);
    presence([[0, 1]]);
    viewer.dispatchEvent(new Event("replaced"));
    socket = FakeWebSocket.last;
    socket.accept();
    socket.receive({ name: "Welcome", id: "b2", colour: 3, lead: 100_000 }, { name: "Grant", limb: 0, epoch: 4 });
    expect(socket.messagesOf("Bond")).toEqual([{ name: "Bond", limbs: [0, 1], wanted: true }]);
  });

  test("that was lost with its hand is requested again, one that was let go is not", () => {
    puppeteer.claim(0);
    socket.receive({ name: "Grant", limb: 0, epoch: 3 });
    puppeteer.bond(0, 1);
    presence([[0, 1]]);
    socket.receive(
      { name: "Refusal", limb: 0, reason: "lost", holder: null },
      { name: "BondEnd", limbs: [0, 1], reason: "lost" },
      { name: "Grant", limb: 0, epoch: 4 },
    );
    expect(socket.messagesOf("Bond")).toHaveLength(2);
    puppeteer.unbond(0, 1);
    expect(socket.messagesOf("Bond")).toHaveLength(3);
    socket.receive({ name: "Refusal", limb: 0, reason: "lost", holder: null }, { name: "Grant", limb: 0, epoch: 5 });
    expect(socket.messagesOf("Bond")).toHaveLength(3);
  });

  test("reports its end with the reason", () => {
    const ends: unknown[] = [];
    puppeteer.addEventListener("bondend", (event) => ends.push((event as CustomEvent).detail));
    socket.receive({ name: "BondEnd", limbs: [0, 5], reason: "apart" });
    expect(ends).toEqual([{ limbs: [0, 5], reason: "apart" }]);
  });
});

describe("props", () => {
  test("are put into a hand and laid down, and refusals have a reason", () => {
    const refusals: unknown[] = [];
    puppeteer.addEventListener("prop refusal", (event) => refusals.push((event as CustomEvent).detail));
    expect(puppeteer.put(2, 5)).toBe(true);
    puppeteer.put(2, null, [0.5, -1, 2]);
    expect(socket.messagesOf("Put")).toEqual([
      { name: "Put", prop: 2, limb: 5, place: null },
      { name: "Put", prop: 2, limb: null, place: [0.5, -1, 2] },
    ]);
    socket.receive({ name: "PropRefusal", prop: 2, reason: "held" });
    expect(refusals).toEqual([{ prop: 2, reason: "held" }]);
  });
});

describe("request for a limb that another puppeteer holds", () => {
  const presence = (limbs: (string | null)[], asks: string[][]) =>
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
  const held = ["b2", null, null, null];
  let events: unknown[];

  beforeEach(() => {
    events = [];
    for (const name of ["grant", "lapsed", "refusal"])
      puppeteer.addEventListener(name, (event) => events.push([name, (event as CustomEvent).detail]));
    puppeteer.ask(0);
    puppeteer.ask(0);
  });

  test("is sent once, and ends with a grant without a claim", () => {
    expect(socket.messagesOf("Ask")).toEqual([{ name: "Ask", limb: 0, wanted: true }]);
    presence(held, [["c3", "a1"], [], [], []]);
    presence(held, [["a1"], [], [], []]);
    expect([puppeteer.isAsking(0), puppeteer.holds(0), events]).toEqual([true, false, []]);
    socket.receive({ name: "Grant", limb: 0, epoch: 9 });
    presence(["a1", null, null, null], [[], [], [], []]);
    expect([puppeteer.isAsking(0), puppeteer.holds(0)]).toEqual([false, true]);
    expect(events).toEqual([["grant", { limb: 0, asked: true }]]);
    puppeteer.target(0, 0.5, 0, 0);
    expect([
      socket.messagesOf("Claim"),
      socket.messagesOf("Release"),
      socket.messagesOf("Input").at(-1)?.epoch,
    ]).toEqual([[], [], 9]);
  });

  test("stays if Presence shows the grant before the grant arrives", () => {
    presence(held, [["a1"], [], [], []]);
    presence(["a1", null, null, null], [[], [], [], []]);
    socket.receive({ name: "Grant", limb: 0, epoch: 9 });
    expect(events).toEqual([["grant", { limb: 0, asked: true }]]);
  });

  test("can be withdrawn, and a late grant is released", () => {
    puppeteer.cancelAsk(0);
    puppeteer.cancelAsk(0);
    expect(socket.messagesOf("Ask")).toEqual([
      { name: "Ask", limb: 0, wanted: true },
      { name: "Ask", limb: 0, wanted: false },
    ]);
    presence(held, [["a1"], [], [], []]);
    expect(puppeteer.isAsking(0)).toBe(false);
    socket.receive({ name: "Grant", limb: 0, epoch: 9 });
    expect(socket.messagesOf("Release")).toEqual([{ name: "Release", limb: 0, epoch: 9 }]);
    expect(events).toEqual([]);
  });

  test("lapses when Presence no longer lists it", () => {
    presence(held, [[], [], [], []]);
    expect(puppeteer.isAsking(0)).toBe(true);
    presence(held, [["a1"], [], [], []]);
    presence(held, [[], [], [], []]);
    expect([puppeteer.isAsking(0), events]).toEqual([false, [["lapsed", { limb: 0, free: false }]]]);
  });

  test("lapses if the limb was free when it arrived", () => {
    presence([null, null, null, null], [[], [], [], []]);
    expect([puppeteer.isAsking(0), events]).toEqual([false, [["lapsed", { limb: 0, free: true }]]]);
  });

  test("lapses after 20 s without Presence, and with the connection", () => {
    advanceTime(19_000);
    expect(puppeteer.isAsking(0)).toBe(true);
    advanceTime(1_100);
    expect([puppeteer.isAsking(0), events]).toEqual([false, [["lapsed", { limb: 0, free: false }]]]);
    puppeteer.ask(0);
    socket.endWith(1006);
    expect(puppeteer.isAsking(0)).toBe(false);
    puppeteer.ask(0);
    expect(puppeteer.isAsking(0)).toBe(false);
  });

  test("is not sent for a claimed limb", () => {
    puppeteer.claim(1);
    puppeteer.ask(1);
    expect(socket.messagesOf("Ask")).toHaveLength(1);
  });
});

test("notice is dispatched", () => {
  const events: unknown[] = [];
  puppeteer.addEventListener("notice", (event) => events.push((event as CustomEvent).detail));
  socket.receive({ name: "Notice", limb: 1, reason: "reach", detail: "too far" });
  expect(events).toEqual([{ limb: 1, reason: "reach", detail: "too far" }]);
});

describe("inputs", () => {
  beforeEach(() => {
    puppeteer.claim(0);
    socket.receive({ name: "Grant", limb: 0, epoch: 5 });
  });

  test("carry epoch, increasing sequence and sample time", () => {
    advanceTime(40);
    puppeteer.target(0, 0.5, -0.25, 0.125);
    advanceTime(40);
    puppeteer.target(0, 0.25, -0.25, 0.125);
    const inputs = socket.messagesOf("Input");
    expect(inputs).toHaveLength(2);
    expect(inputs[0]).toEqual({
      name: "Input",
      limb: 0,
      kind: 1,
      epoch: 5,
      sequence: 0,
      sampled: EPOCH_US + 40_000,
      values: [0.5, -0.25, 0.125],
    });
    expect([inputs[1].sequence, inputs[1].sampled]).toEqual([1, EPOCH_US + 80_000]);
  });

  test("at 1000 Hz are thinned, and the last one is always sent", () => {
    for (let moved = 0; moved < 500; moved++) {
      advanceTime(1);
      puppeteer.target(0, moved / 1000, 0, 0);
    }
    advanceTime(100);
    const inputs = socket.messagesOf("Input");
    expect(inputs.length).toBeGreaterThan(25);
    expect(inputs.length).toBeLessThan(40);
    expect(inputs[inputs.length - 1].values[0]).toBeCloseTo(0.499, 6);
  });

  test("wait while the connection is congested, then the newest is sent", () => {
    socket.bufferedAmount = 5_000;
    advanceTime(40);
    puppeteer.target(0, 0.1, 0, 0);
    advanceTime(200);
    puppeteer.target(0, 0.9, 0, 0);
    advanceTime(200);
    expect(socket.messagesOf("Input")).toEqual([]);
    socket.bufferedAmount = 0;
    advanceTime(40);
    expect(socket.messagesOf("Input").map((input) => input.values[0])).toEqual([Math.fround(0.9)]);
  });

  test("with velocity send start, velocity and end position", () => {
    viewer.poseAt(now);
    puppeteer.target(0, 0, 0, 0);
    advanceTime(100);
    puppeteer.velocity(0, 1, 0, 0);
    puppeteer.velocity(0, 1, 0, 0);
    advanceTime(200);
    puppeteer.velocity(0, 0, 0, 0);
    advanceTime(100);
    const sent = socket.messagesOf("Input").map(({ kind, values }) => [kind, values[0]]);
    expect(sent).toEqual([
      [1, 0],
      [0, 1],
      [1, Math.fround(0.2)],
    ]);
  });

  test("with velocity before any target start at the session's position", () => {
    advanceTime(40);
    puppeteer.velocity(0, 0.5, 0, 0);
    expect(socket.messagesOf("Input").map(({ kind, values }) => [kind, ...values])).toEqual([[0, 0.5, 0, 0]]);
  });

  test("are finite and clamped", () => {
    advanceTime(40);
    puppeteer.velocity(0, NaN, 7, -Infinity);
    advanceTime(40);
    puppeteer.target(0, NaN, Infinity, 0.5);
    expect(socket.messagesOf("Input").map(({ values }) => values)).toEqual([
      [0, 1, 0],
      [0, 0, 0.5],
    ]);
  });

  test("for unclaimed limbs are not sent", () => {
    puppeteer.target(3, 1, 0, 0);
    puppeteer.velocity(3, 1, 0, 0);
    advanceTime(100);
    expect(socket.messagesOf("Input")).toEqual([]);
  });
});

test("keep-alive at 10 Hz lists only limbs that are held still", () => {
  puppeteer.claim(0);
  puppeteer.claim(2);
  socket.receive({ name: "Grant", limb: 0, epoch: 1 }, { name: "Grant", limb: 2, epoch: 1 });
  for (let moved = 0; moved < 50; moved++) {
    advanceTime(20);
    puppeteer.target(0, moved / 100, 0, 0);
  }
  const alive = socket.messagesOf("Alive");
  expect(alive.length).toBeGreaterThanOrEqual(7);
  expect(alive.length).toBeLessThanOrEqual(11);
  for (const { limbs } of alive.slice(1)) expect(limbs).toEqual([2]);
});

describe("own limb", () => {
  test("is shown before the session answers", () => {
    const before = tipPosition();
    puppeteer.claim(0);
    puppeteer.target(0, 0.5, -0.3, 0.4);
    expect(distance(tipPosition(), before)).toBeLessThan(1e-9);
    draw(50);
    expect(distance(tipPosition(), before)).toBeGreaterThan(0.02);
    draw(500);
    expect(distance(tipPosition(), [0.5, -0.3, 0.4])).toBeLessThan(1e-6);
  });

  test("returns to the motion when it is refused", () => {
    const before = tipPosition();
    puppeteer.claim(0);
    puppeteer.target(0, 0.5, -0.3, 0.4);
    draw(200);
    const last = tipPosition();
    socket.receive({ name: "Refusal", limb: 0, reason: "held", holder: "b2" });
    expect(distance(tipPosition(), last)).toBeLessThan(1e-9);
    draw(50);
    expect(distance(tipPosition(), last)).toBeLessThan(0.3);
    draw(600);
    expect(distance(tipPosition(), before)).toBeLessThan(1e-9);
  });

  test("is shown as the session sends it while another puppeteer holds it", () => {
    const before = tipPosition();
    socket.receive({
      name: "Presence",
      live: null,
      bonds: null,
      crowd: null,
      props: null,
      viewers: 2,
      puppeteers: [],
      limbs: ["b2", null, null, null],
      asks: [[], [], [], []],
    });
    puppeteer.claim(0);
    puppeteer.target(0, 0.5, -0.3, 0.4);
    draw(200);
    expect(distance(tipPosition(), before)).toBeLessThan(1e-9);
    socket.receive({ name: "Grant", limb: 0, epoch: 3 });
    draw(600);
    expect(distance(tipPosition(), [0.5, -0.3, 0.4])).toBeLessThan(1e-6);
  });
});

test("close releases all limbs", () => {
  puppeteer.claim(0);
  socket.receive({ name: "Grant", limb: 0, epoch: 2 });
  const reasons: string[] = [];
  puppeteer.addEventListener("closed", (event) => reasons.push((event as CustomEvent<string>).detail));
  puppeteer.close();
  expect(socket.messagesOf("Release")).toHaveLength(1);
  expect(reasons).toEqual(["closed here"]);
});
