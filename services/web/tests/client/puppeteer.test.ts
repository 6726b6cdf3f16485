import { afterEach, beforeEach, describe, expect, test } from "vitest";
import { createMarionetteSolver } from "../../src/client/marionette-solver";
import type { Puppeteer } from "../../src/client/puppeteer";
import type { Viewer } from "../../src/client/viewer";
import { goldenDescription } from "../golden-motion";
import { table } from "../marionette/figure";
import { advanceTime, EPOCH_US, endControlSession, now, startControlSession } from "./control-session";
import { FakeWebSocket } from "./fake-websocket";

let viewer: Viewer;
let stream: FakeWebSocket;
let puppeteer: Puppeteer;
let line: FakeWebSocket;

beforeEach(async () => {
  ({ viewer, viewerSocket: stream, puppeteer, socket: line } = await startControlSession([goldenDescription()]));
});

afterEach(() => endControlSession({ viewer, viewerSocket: stream, puppeteer, socket: line }));

/** Where the left hand is as drawn now. */
function drawn(): number[] {
  const [hand] = createMarionetteSolver(viewer.figure!, [table, table]).limbs;
  hand.observePose(viewer.poseAt(now)!.rotations, 0);
  return [...hand.position];
}

/** Draws `ms` milliseconds, 60 frames a second. */
function draw(ms: number): void {
  for (let passed = 0; passed < ms; passed += 1000 / 60) {
    advanceTime(1000 / 60);
    viewer.poseAt(now);
  }
}

function far(a: number[], b: number[]): number {
  return Math.hypot(...a.map((value, axis) => value - b[axis]));
}

test("is welcomed", () => {
  expect([puppeteer.id, puppeteer.colour]).toEqual(["a1", 2]);
  expect(puppeteer.limits).toMatchObject({ reach: 1, handSpeed: 1, legSpeed: 2 });
});

test("where the viewer's silent line is replaced it tries another too, and asks again for what it holds", () => {
  puppeteer.claim(0);
  line.receive({ name: "Grant", limb: 0, epoch: 3 });
  viewer.dispatchEvent(new Event("replaced"));
  const other = FakeWebSocket.last;
  expect(other).not.toBe(line);
  other.accept();
  expect(puppeteer.id).toBe("a1");
  other.receive({ name: "Welcome", id: "b2", colour: 3, lead: 100_000 });
  expect([puppeteer.id, line.readyState]).toEqual(["b2", 3]);
  expect(other.messagesOf("Claim")).toEqual([{ name: "Claim", limb: 0 }]);
  puppeteer.close();
  const count = FakeWebSocket.opened.length;
  viewer.dispatchEvent(new Event("replaced"));
  expect(FakeWebSocket.opened).toHaveLength(count);
});

describe("a limb", () => {
  test("is claimed, granted and let go with its epoch", () => {
    const granted: unknown[] = [];
    puppeteer.addEventListener("grant", (event) => granted.push((event as CustomEvent).detail));
    puppeteer.claim(1);
    puppeteer.claim(1);
    expect(line.messagesOf("Claim")).toEqual([{ name: "Claim", limb: 1 }]);
    expect(puppeteer.holds(1)).toBe(false);
    line.receive({ name: "Grant", limb: 1, epoch: 7 });
    expect(granted).toEqual([{ limb: 1, asked: false }]);
    expect(puppeteer.holds(1)).toBe(true);
    puppeteer.release(1);
    expect(line.messagesOf("Release")).toEqual([{ name: "Release", limb: 1, epoch: 7 }]);
    expect(puppeteer.holds(1)).toBe(false);
  });

  test("let go before the answer came is let go when it comes", () => {
    puppeteer.claim(0);
    puppeteer.release(0);
    expect(line.messagesOf("Release")).toEqual([]);
    line.receive({ name: "Grant", limb: 0, epoch: 3 });
    expect(line.messagesOf("Release")).toEqual([{ name: "Release", limb: 0, epoch: 3 }]);
    expect(puppeteer.holds(0)).toBe(false);
  });

  test("refused goes back, and says why", () => {
    const refused: unknown[] = [];
    puppeteer.addEventListener("refusal", (event) => refused.push((event as CustomEvent).detail));
    puppeteer.claim(0);
    line.receive({ name: "Refusal", limb: 0, reason: "held", holder: "b2" });
    puppeteer.target(0, 1, 0, 0);
    advanceTime(100);
    expect(refused).toEqual([{ limb: 0, reason: "held", holder: "b2" }]);
    expect(line.messagesOf("Input")).toEqual([]);
  });

  test("lost for want of a word while it is still held is asked for again, unless another took it meanwhile", () => {
    const refused: unknown[] = [];
    puppeteer.addEventListener("refusal", (event) => refused.push((event as CustomEvent).detail));
    puppeteer.claim(0);
    line.receive({ name: "Grant", limb: 0, epoch: 3 });
    puppeteer.target(0, 0.5, 0, 0);
    line.receive({ name: "Refusal", limb: 0, reason: "lost", holder: null });
    expect(line.messagesOf("Claim")).toHaveLength(2);
    expect([puppeteer.holds(0), refused]).toEqual([false, []]);
    line.receive({ name: "Grant", limb: 0, epoch: 4 });
    expect(puppeteer.holds(0)).toBe(true);
    // The session is told anew where the hand is.
    expect(line.messagesOf("Input").at(-1)).toMatchObject({ epoch: 4, values: [0.5, 0, 0] });
    line.receive(
      { name: "Refusal", limb: 0, reason: "lost", holder: null },
      { name: "Refusal", limb: 0, reason: "held", holder: "b2" },
    );
    expect(refused).toEqual([{ limb: 0, reason: "held", holder: "b2" }]);
  });

  test("lost after it was let go is not asked for", () => {
    puppeteer.claim(0);
    line.receive({ name: "Grant", limb: 0, epoch: 3 });
    puppeteer.release(0);
    line.receive({ name: "Refusal", limb: 0, reason: "lost", holder: null });
    expect(line.messagesOf("Claim")).toHaveLength(1);
  });

  test("is asked for again when the line comes back", () => {
    puppeteer.claim(0);
    line.receive({ name: "Grant", limb: 0, epoch: 3 });
    line.endWith(1006);
    expect(puppeteer.holds(0)).toBe(false);
    advanceTime(250);
    line = FakeWebSocket.last;
    line.accept();
    line.receive({ name: "Welcome", id: "a9", colour: 0, lead: 100_000 });
    expect(line.messagesOf("Claim")).toEqual([{ name: "Claim", limb: 0 }]);
  });
});

describe("asking for a limb that another holds", () => {
  const presence = (limbs: (string | null)[], asks: string[][]) =>
    line.receive({ name: "Presence", viewers: 2, puppeteers: [], limbs, asks });
  const held = ["b2", null, null, null];
  let told: unknown[];

  beforeEach(() => {
    told = [];
    for (const name of ["grant", "lapsed", "refusal"])
      puppeteer.addEventListener(name, (event) => told.push([name, (event as CustomEvent).detail]));
    puppeteer.ask(0);
    puppeteer.ask(0);
  });

  test("is said once, and brings it by a grant, unclaimed", () => {
    expect(line.messagesOf("Ask")).toEqual([{ name: "Ask", limb: 0, wanted: true }]);
    presence(held, [["c3", "a1"], [], [], []]);
    presence(held, [["a1"], [], [], []]);
    expect([puppeteer.isAsking(0), puppeteer.holds(0), told]).toEqual([true, false, []]);
    line.receive({ name: "Grant", limb: 0, epoch: 9 });
    presence(["a1", null, null, null], [[], [], [], []]);
    expect([puppeteer.isAsking(0), puppeteer.holds(0)]).toEqual([false, true]);
    expect(told).toEqual([["grant", { limb: 0, asked: true }]]);
    puppeteer.target(0, 0.5, 0, 0);
    expect([line.messagesOf("Claim"), line.messagesOf("Release"), line.messagesOf("Input").at(-1)?.epoch]).toEqual([
      [],
      [],
      9,
    ]);
  });

  test("is not over when Presence tells of the grant before the grant", () => {
    presence(held, [["a1"], [], [], []]);
    presence(["a1", null, null, null], [[], [], [], []]);
    line.receive({ name: "Grant", limb: 0, epoch: 9 });
    expect(told).toEqual([["grant", { limb: 0, asked: true }]]);
  });

  test("can be withdrawn; a grant that crosses that is given back", () => {
    puppeteer.cancelAsk(0);
    puppeteer.cancelAsk(0);
    expect(line.messagesOf("Ask")).toEqual([
      { name: "Ask", limb: 0, wanted: true },
      { name: "Ask", limb: 0, wanted: false },
    ]);
    presence(held, [["a1"], [], [], []]);
    expect(puppeteer.isAsking(0)).toBe(false);
    line.receive({ name: "Grant", limb: 0, epoch: 9 });
    expect(line.messagesOf("Release")).toEqual([{ name: "Release", limb: 0, epoch: 9 }]);
    expect(told).toEqual([]);
  });

  test("lapses when Presence no longer lists it", () => {
    presence(held, [[], [], [], []]);
    expect(puppeteer.isAsking(0)).toBe(true);
    presence(held, [["a1"], [], [], []]);
    presence(held, [[], [], [], []]);
    expect([puppeteer.isAsking(0), told]).toEqual([false, [["lapsed", { limb: 0, free: false }]]]);
  });

  test("lapses when its holder let go before the session heard of it", () => {
    presence([null, null, null, null], [[], [], [], []]);
    expect([puppeteer.isAsking(0), told]).toEqual([false, [["lapsed", { limb: 0, free: true }]]]);
  });

  test("lapses after 20 seconds in a session that knows of no asking, and with the line", () => {
    advanceTime(19_000);
    expect(puppeteer.isAsking(0)).toBe(true);
    advanceTime(1_100);
    expect([puppeteer.isAsking(0), told]).toEqual([false, [["lapsed", { limb: 0, free: false }]]]);
    puppeteer.ask(0);
    line.endWith(1006);
    expect(puppeteer.isAsking(0)).toBe(false);
    puppeteer.ask(0);
    expect(puppeteer.isAsking(0)).toBe(false);
  });

  test("is not for a limb that is held here", () => {
    puppeteer.claim(1);
    puppeteer.ask(1);
    expect(line.messagesOf("Ask")).toHaveLength(1);
  });
});

test("a notice is passed on", () => {
  const told: unknown[] = [];
  puppeteer.addEventListener("notice", (event) => told.push((event as CustomEvent).detail));
  line.receive({ name: "Notice", limb: 1, reason: "reach", detail: "too far" });
  expect(told).toEqual([{ limb: 1, reason: "reach", detail: "too far" }]);
});

describe("inputs", () => {
  beforeEach(() => {
    puppeteer.claim(0);
    line.receive({ name: "Grant", limb: 0, epoch: 5 });
  });

  test("carry epoch, rising sequence and the clock time of the sample", () => {
    advanceTime(40);
    puppeteer.target(0, 0.5, -0.25, 0.125);
    advanceTime(40);
    puppeteer.target(0, 0.25, -0.25, 0.125);
    const inputs = line.messagesOf("Input");
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

  test("of a mouse that moves a thousand times a second are thinned, and the last always goes", () => {
    for (let moved = 0; moved < 500; moved++) {
      advanceTime(1);
      puppeteer.target(0, moved / 1000, 0, 0);
    }
    advanceTime(100);
    const inputs = line.messagesOf("Input");
    expect(inputs.length).toBeGreaterThan(25);
    expect(inputs.length).toBeLessThan(40);
    expect(inputs[inputs.length - 1].values[0]).toBeCloseTo(0.499, 6);
  });

  test("wait while the line is crowded, and then the newest goes", () => {
    line.bufferedAmount = 5_000;
    advanceTime(40);
    puppeteer.target(0, 0.1, 0, 0);
    advanceTime(200);
    puppeteer.target(0, 0.9, 0, 0);
    advanceTime(200);
    expect(line.messagesOf("Input")).toEqual([]);
    line.bufferedAmount = 0;
    advanceTime(40);
    expect(line.messagesOf("Input").map((input) => input.values[0])).toEqual([Math.fround(0.9)]);
  });

  test("of a speed say where it starts, how it goes, and where it stops", () => {
    viewer.poseAt(now);
    puppeteer.target(0, 0, 0, 0);
    advanceTime(100);
    puppeteer.velocity(0, 1, 0, 0);
    puppeteer.velocity(0, 1, 0, 0);
    advanceTime(200);
    puppeteer.velocity(0, 0, 0, 0);
    advanceTime(100);
    const said = line.messagesOf("Input").map(({ kind, values }) => [kind, values[0]]);
    expect(said).toEqual([
      [1, 0],
      [0, 1],
      [1, Math.fround(0.2)],
    ]);
  });

  test("of a limb never placed start from where the session has it", () => {
    advanceTime(40);
    puppeteer.velocity(0, 0.5, 0, 0);
    expect(line.messagesOf("Input").map(({ kind, values }) => [kind, ...values])).toEqual([[0, 0.5, 0, 0]]);
  });

  test("are finite and within -1..1 whatever the controller says", () => {
    advanceTime(40);
    puppeteer.velocity(0, NaN, 7, -Infinity);
    advanceTime(40);
    puppeteer.target(0, NaN, Infinity, 0.5);
    expect(line.messagesOf("Input").map(({ values }) => values)).toEqual([
      [0, 1, 0],
      [0, 0, 0.5],
    ]);
  });

  test("of limbs that are not claimed go nowhere", () => {
    puppeteer.target(3, 1, 0, 0);
    puppeteer.velocity(3, 1, 0, 0);
    advanceTime(100);
    expect(line.messagesOf("Input")).toEqual([]);
  });
});

test("a limb held still is kept alive at 10 Hz, one that moves is not mentioned", () => {
  puppeteer.claim(0);
  puppeteer.claim(2);
  line.receive({ name: "Grant", limb: 0, epoch: 1 }, { name: "Grant", limb: 2, epoch: 1 });
  for (let moved = 0; moved < 50; moved++) {
    advanceTime(20);
    puppeteer.target(0, moved / 100, 0, 0);
  }
  const alive = line.messagesOf("Alive");
  expect(alive.length).toBeGreaterThanOrEqual(7);
  expect(alive.length).toBeLessThanOrEqual(11);
  for (const { limbs } of alive.slice(1)) expect(limbs).toEqual([2]);
});

describe("one's own limb", () => {
  test("is shown at once, before the session has answered", () => {
    const before = drawn();
    puppeteer.claim(0);
    puppeteer.target(0, 0.5, -0.3, 0.4);
    expect(far(drawn(), before)).toBeLessThan(1e-9);
    draw(50);
    expect(far(drawn(), before)).toBeGreaterThan(0.02);
    draw(500);
    expect(far(drawn(), [0.5, -0.3, 0.4])).toBeLessThan(1e-6);
  });

  test("goes back to the dance when it is refused", () => {
    const before = drawn();
    puppeteer.claim(0);
    puppeteer.target(0, 0.5, -0.3, 0.4);
    draw(200);
    const held = drawn();
    line.receive({ name: "Refusal", limb: 0, reason: "held", holder: "b2" });
    expect(far(drawn(), held)).toBeLessThan(1e-9);
    draw(50);
    expect(far(drawn(), held)).toBeLessThan(0.3);
    draw(600);
    expect(far(drawn(), before)).toBeLessThan(1e-9);
  });

  test("is what everyone sees while Presence has it in another's hands", () => {
    const before = drawn();
    line.receive({
      name: "Presence",
      viewers: 2,
      puppeteers: [],
      limbs: ["b2", null, null, null],
      asks: [[], [], [], []],
    });
    puppeteer.claim(0);
    puppeteer.target(0, 0.5, -0.3, 0.4);
    draw(200);
    expect(far(drawn(), before)).toBeLessThan(1e-9);
    line.receive({ name: "Grant", limb: 0, epoch: 3 });
    draw(600);
    expect(far(drawn(), [0.5, -0.3, 0.4])).toBeLessThan(1e-6);
  });
});

test("leaving lets all go", () => {
  puppeteer.claim(0);
  line.receive({ name: "Grant", limb: 0, epoch: 2 });
  const reasons: string[] = [];
  puppeteer.addEventListener("closed", (event) => reasons.push((event as CustomEvent<string>).detail));
  puppeteer.close();
  expect(line.messagesOf("Release")).toHaveLength(1);
  expect(reasons).toEqual(["closed here"]);
});
