import { afterEach, beforeEach, describe, expect, test } from "vitest";
import { Puppeteer } from "../../src/client/puppeteer";
import { Viewer } from "../../src/client/viewer";
import { type AskOffer, ClaimController } from "../../src/engine/claim-controller";
import type { Playback } from "../../src/engine/playback";
import type { LimbController } from "../../src/input/limb-controller";
import { DEFAULT_MAPPING } from "../../src/input/mapping";
import { VelocityInputs } from "../../src/input/velocity-input";
import type { LimbState } from "../../src/ui/limb-state";
import { FakeWebSocket } from "../client/fake-websocket";
import { goldenDescription } from "../golden-motion";
import { createLimbController, type FakePuppeteer } from "../input/fake-puppeteer";
import { createStandingPuppet } from "../stage/puppet/figures";

const [LEFT_HAND, RIGHT_HAND] = [0, 1];
const PEOPLE = [
  { id: "a", name: "Aiko", colour: 0 },
  { id: "m", name: "Mateo", colour: 1 },
];

let controller: ClaimController;
let hands: LimbController;
let velocity: VelocityInputs;
let viewer: Viewer;
let puppeteer: Puppeteer;
let stream: FakeWebSocket;
let control: FakeWebSocket;
let toasts: [string, AskOffer | undefined][];
let notices: string[];
let shaken: number[];
let shown: readonly LimbState[];
let shownPerformer: number;
let isReady: boolean;
let giveKey: string | null;

beforeEach(() => {
  FakeWebSocket.install();
  [toasts, notices, shaken, giveKey] = [[], [], [], null];
  viewer = new Viewer({ url: "ws://stage/stream", now: () => 0, solver: () => new Promise(() => undefined) });
  stream = FakeWebSocket.last;
  stream.accept();
  puppeteer = new Puppeteer({ url: "ws://stage/control", viewer, now: () => 0 });
  control = FakeWebSocket.last;
  control.accept();
  controller = new ClaimController(
    {
      render: (state) => ({ limbs: shown, performer: shownPerformer, giveKey } = state),
      toast: (message, offer) => toasts.push([message, offer]),
      notice: (text) => notices.push(text),
    },
    () => DEFAULT_MAPPING,
  );
  hands = createLimbController(createStandingPuppet(), puppeteer as unknown as FakePuppeteer);
  velocity = new VelocityInputs(hands, {
    claim: (limb) => controller.claim(limb, "velocity"),
    isFree: (limb) => controller.canPull(limb),
    selection: controller.selectedPerformer,
  });
  hands.onChange = () => controller.render();
  controller.stageInputs = { hands, velocity, shakeRing: (limb) => shaken.push(limb) };
  controller.setPlayback({ viewer, puppeteer } as unknown as Playback);
  controller.connected = true;
  control.receive({ name: "Welcome", id: "a", colour: 0, lead: 100_000 });
});
afterEach(() => {
  puppeteer.close();
  viewer.close();
  FakeWebSocket.remove();
});

test("limbs can be claimed once the stage and the connection are there", () => {
  const early = new ClaimController(
    { render: (state) => (isReady = state.isReady), toast: () => undefined, notice: () => undefined },
    () => DEFAULT_MAPPING,
  );
  early.setPlayback({ viewer, puppeteer } as unknown as Playback);
  early.connected = true;
  early.render();
  expect(isReady).toBe(false);
  early.stageInputs = { hands, velocity, shakeRing: () => undefined };
  expect(isReady).toBe(true);
});

/** Send a presence message on both connections. */
function sendPresence(limbs: (string | null)[], asks: string[][] = [[], [], [], []]): void {
  for (const socket of [stream, control])
    socket.receive({
      name: "Presence",
      live: null,
      bonds: null,
      crowd: null,
      props: null,
      viewers: 2,
      puppeteers: PEOPLE,
      limbs,
      asks,
    });
}

test("limb that is open to the audience can be pulled by viewers too, and is not shown as held here", () => {
  controller.viewOnly = true;
  const presence = (crowd: { limb: number; policy: string; pulls: number }[] | null) =>
    stream.receive({
      name: "Presence",
      live: null,
      bonds: null,
      props: null,
      crowd,
      viewers: 2,
      puppeteers: [],
      limbs: ["crowd", null, null, null],
      asks: [[], [], [], []],
    });
  presence(null);
  expect([controller.canPull(LEFT_HAND), controller.canPull(RIGHT_HAND)]).toEqual([false, false]);
  presence([{ limb: LEFT_HAND, policy: "median", pulls: 3 }]);
  expect([controller.canPull(LEFT_HAND), controller.canPull(RIGHT_HAND)]).toEqual([true, false]);
  hands.claim(LEFT_HAND, "pointer");
  expect(controller.limbStates()[LEFT_HAND].holder?.name).toBe("The audience");
  hands.release(LEFT_HAND);
  controller.toggleClaim(LEFT_HAND);
  expect([hands.isCrowdPull(LEFT_HAND), velocity.selectedLimb]).toEqual([true, LEFT_HAND]);
  controller.toggleClaim(LEFT_HAND);
  expect(hands.source(LEFT_HAND)).toBe(null);
  expect([control.messagesOf("Claim"), toasts]).toEqual([[], []]);
  controller.toggleClaim(RIGHT_HAND);
  expect([hands.source(RIGHT_HAND), toasts.map(([message]) => message)]).toEqual([
    null,
    ["With this link you pull only what is open to the audience"],
  ]);
});

test("audience of an open limb is shown with its votes and this page's turn", () => {
  sendPresence([null, null, null, null]);
  expect(controller.limbStates()[LEFT_HAND].crowd).toBe(undefined);
  stream.receive(
    {
      name: "Presence",
      live: null,
      bonds: null,
      props: null,
      crowd: [{ limb: LEFT_HAND, policy: "vote", pulls: 3 }],
      viewers: 2,
      puppeteers: [],
      limbs: ["crowd", null, null, null],
      asks: [[], [], [], []],
    },
    { name: "CrowdPulls", limb: LEFT_HAND, count: 3, places: [[0, 1, 0]], votes: [3, 0, 0, 0, 0] },
    { name: "CrowdTurn", limb: LEFT_HAND, yours: true },
  );
  expect(shown[LEFT_HAND].crowd).toEqual({
    policy: "vote",
    pulls: 3,
    votes: [3, 0, 0, 0, 0],
    hasTurn: true,
    isPulled: false,
  });
});

test("a hand that is pulled with the audience cannot be joined with another", () => {
  stream.receive({
    name: "Presence",
    live: null,
    bonds: null,
    props: null,
    crowd: [{ limb: LEFT_HAND, policy: "median", pulls: 0 }],
    viewers: 2,
    puppeteers: [],
    limbs: [null, null, null, null],
    asks: [[], [], [], []],
  });
  velocity.hold(LEFT_HAND);
  controller.joinHands();
  expect([toasts.at(-1)?.[0], control.messagesOf("Bond")]).toEqual(["Hold a hand, then join it with another", []]);
});

describe("limb held by another user", () => {
  beforeEach(() => sendPresence(["m", null, null, null]));

  test("claiming it shakes the ring, names the holder and offers to ask", () => {
    expect(velocity.hold(LEFT_HAND)).toBe(false);
    expect([hands.source(LEFT_HAND), shaken, control.messagesOf("Claim")]).toEqual([null, [LEFT_HAND], []]);
    expect(toasts.map(([message, offer]) => [message, offer?.label, offer?.key])).toEqual([
      ["Mateo holds the left hand", "Ask", "R"],
    ]);
    controller.requestLimb(toasts[0][1]?.limb);
    expect(control.messagesOf("Ask")).toEqual([{ name: "Ask", limb: LEFT_HAND, wanted: true }]);
    expect([shown[LEFT_HAND].requestedByMe, shown[RIGHT_HAND].requestedByMe]).toEqual([true, false]);
    velocity.hold(LEFT_HAND);
    expect(toasts.at(-1)).toEqual(["You ask Mateo for the left hand", undefined]);
  });

  test("request key works after a refused claim, and not before", () => {
    controller.requestLimb();
    expect([toasts.at(-1)?.[0], control.messagesOf("Ask")]).toEqual([
      "Reach for a string that someone else holds, then ask for it",
      [],
    ]);
    controller.toggleClaim(LEFT_HAND);
    controller.requestLimb();
    expect(control.messagesOf("Ask")).toHaveLength(1);
    controller.withdrawRequest(LEFT_HAND);
    expect([control.messagesOf("Ask")[1].wanted, shown[LEFT_HAND].requestedByMe]).toEqual([false, false]);
  });

  test("granted limb is held and selected", () => {
    controller.requestLimb(LEFT_HAND);
    sendPresence(["m", null, null, null], [["a"], [], [], []]);
    control.receive({ name: "Grant", limb: LEFT_HAND, epoch: 4 });
    expect([velocity.holds(LEFT_HAND), velocity.selectedLimb]).toEqual([true, LEFT_HAND]);
    sendPresence(["a", null, null, null]);
    expect(shown[LEFT_HAND]).toMatchObject({
      holder: { name: "You", mine: true },
      requestedByMe: false,
      selected: true,
    });
    expect([toasts.at(-1)?.[0], control.messagesOf("Claim"), control.messagesOf("Release")]).toEqual([
      "The left hand is yours",
      [],
      [],
    ]);
  });

  test("refused or lapsed request shows a message", () => {
    controller.requestLimb(LEFT_HAND);
    sendPresence(["m", null, null, null], [["a"], [], [], []]);
    sendPresence(["m", null, null, null]);
    controller.requestLimb(LEFT_HAND);
    sendPresence([null, null, null, null]);
    expect(toasts.map(([message]) => message)).toEqual([
      "You ask Mateo for the left hand",
      "Your request for the left hand was not granted",
      "You ask Mateo for the left hand",
      "The left hand is free now",
    ]);
  });
});

describe("own limb requested by another user", () => {
  beforeEach(() => {
    for (const limb of [RIGHT_HAND, LEFT_HAND]) {
      velocity.hold(limb);
      control.receive({ name: "Grant", limb, epoch: 7 + limb });
    }
  });

  test("is kept until it is handed over by one key", () => {
    sendPresence(["a", "a", null, null], [[], ["m"], [], []]);
    expect([shown[RIGHT_HAND].requesters.map(({ name }) => name), shown[LEFT_HAND].requesters, giveKey]).toEqual([
      ["Mateo"],
      [],
      "G",
    ]);
    expect(velocity.holds(RIGHT_HAND)).toBe(true);
    controller.handOver();
    expect(control.messagesOf("Release")).toEqual([{ name: "Release", limb: RIGHT_HAND, epoch: 8 }]);
    expect([hands.source(RIGHT_HAND), hands.source(LEFT_HAND)]).toEqual([null, "velocity"]);
  });

  test("hand-over prefers the selected limb, and needs a request", () => {
    controller.handOver();
    expect([toasts.at(-1)?.[0], control.messagesOf("Release")]).toEqual(["Nobody is asking for your strings", []]);
    sendPresence(["a", "a", null, null], [["m"], ["m"], [], []]);
    expect(velocity.selectedLimb).toBe(LEFT_HAND);
    controller.handOver();
    expect(control.messagesOf("Release").map(({ limb }) => limb)).toEqual([LEFT_HAND]);
  });
});

test("claim refused by the session releases the limb and names its holder", () => {
  sendPresence([null, null, null, null]);
  velocity.hold(LEFT_HAND);
  sendPresence(["m", null, null, null]);
  control.receive({ name: "Refusal", limb: LEFT_HAND, reason: "held", holder: "m" });
  expect([hands.source(LEFT_HAND), toasts.at(-1)?.[0]]).toEqual([null, "Mateo holds the left hand"]);
});

test("notices are shown in the strings panel, not as toasts", () => {
  control.receive({ name: "Notice", limb: 0, reason: "reach", detail: "out of reach" });
  expect([notices, toasts]).toEqual([["out of reach"], []]);
});

describe("several performers", () => {
  const SECOND = 4;

  /** Switch to a motion with this many performers. */
  function showMotion(motion: string, performers: number): void {
    stream.receive({
      name: "Description",
      motion,
      first: null,
      tracks: Array.from({ length: performers }, () => goldenDescription()),
    });
  }
  beforeEach(() => showMotion("two", 2));

  test("each has four limbs, named with the performer's number", () => {
    sendPresence([null, null, null, null, "m", null, null, null], Array(8).fill([]));
    expect([shown.length, shown[0].holder, shown[SECOND].holder?.name]).toEqual([8, null, "Mateo"]);
    controller.selectedPerformer.select(1);
    expect(shownPerformer).toBe(1);
    velocity.hold(velocity.limb(LEFT_HAND));
    expect(toasts.at(-1)?.[0]).toBe("Mateo holds the left hand of dancer 2");
    expect(shaken).toEqual([SECOND + LEFT_HAND]);
    controller.requestLimb();
    expect(control.messagesOf("Ask")).toEqual([{ name: "Ask", limb: SECOND + LEFT_HAND, wanted: true }]);
  });

  test("next performer is selected in a cycle; a single one is not announced", () => {
    controller.selectNextPerformer();
    controller.selectNextPerformer();
    expect(toasts.map(([message]) => message)).toEqual(["Dancer 2 of 2", "Dancer 1 of 2"]);
    showMotion("one", 1);
    controller.selectNextPerformer();
    expect(toasts).toHaveLength(2);
  });

  test("limbs of removed performers are released; extra limbs in messages are ignored", () => {
    velocity.hold(SECOND + RIGHT_HAND);
    velocity.hold(LEFT_HAND);
    control.receive({ name: "Grant", limb: SECOND + RIGHT_HAND, epoch: 3 });
    controller.selectedPerformer.select(1);
    showMotion("one", 1);
    expect([
      hands.source(SECOND + RIGHT_HAND),
      hands.source(LEFT_HAND),
      controller.selectedPerformer.performer,
      shown.length,
    ]).toEqual([null, "velocity", 0, 4]);
    expect(control.messagesOf("Release")).toEqual([{ name: "Release", limb: SECOND + RIGHT_HAND, epoch: 3 }]);
    sendPresence(["a", null, null, null, "m", null, null, null], [[], [], [], [], ["a"], [], [], []]);
    control.receive({ name: "Refusal", limb: SECOND, reason: "unknown", holder: null });
    controller.requestLimb(SECOND);
    controller.handOver(SECOND);
    expect([controller.isFree(SECOND), shown.length]).toEqual([false, 4]);
    showMotion("three", 3);
    expect(shown.length).toBe(12);
  });
});

describe("joined hands", () => {
  const sendBonds = (bonds: number[][] | null, limbs: (string | null)[]) =>
    control.receive({
      name: "Presence",
      live: null,
      bonds,
      crowd: null,
      props: null,
      viewers: 1,
      puppeteers: PEOPLE,
      limbs,
      asks: limbs.map(() => []),
    });

  test("a hand must be held first", () => {
    controller.joinHands();
    expect([toasts.at(-1)?.[0], control.messagesOf("Bond")]).toEqual(["Hold a hand, then join it with another", []]);
  });

  test("two held hands are joined, announced and parted by the same action", () => {
    velocity.hold(LEFT_HAND);
    velocity.hold(RIGHT_HAND);
    controller.joinHands();
    expect(control.messagesOf("Bond")).toEqual([{ name: "Bond", limbs: [RIGHT_HAND, LEFT_HAND], wanted: true }]);
    sendBonds([[LEFT_HAND, RIGHT_HAND]], ["a", "a", null, null]);
    sendBonds([[LEFT_HAND, RIGHT_HAND]], ["a", "a", null, null]);
    expect(toasts.map(([message]) => message)).toEqual(["The hands are joined"]);
    controller.joinHands();
    expect(control.messagesOf("Bond").at(-1)).toEqual({ name: "Bond", limbs: [LEFT_HAND, RIGHT_HAND], wanted: false });
  });

  test("one held hand leads the free one", () => {
    velocity.hold(LEFT_HAND);
    controller.joinHands();
    expect(control.messagesOf("Bond")).toEqual([{ name: "Bond", limbs: [LEFT_HAND, RIGHT_HAND], wanted: true }]);
    sendPresence([null, "m", null, null]);
    controller.joinHands();
    expect(toasts.at(-1)?.[0]).toBe("These hands cannot be joined");
  });

  test.each([
    ["apart", "The dancers are too far apart to join hands"],
    ["released", "The hands are apart again"],
    ["held", "These hands cannot be joined"],
  ])("the end for the reason %s is announced", (reason, message) => {
    control.receive({ name: "BondEnd", limbs: [0, 1], reason });
    expect(toasts.at(-1)?.[0]).toBe(message);
  });

  test("the hand of another dancer that is opposite comes first", () => {
    controller.selectedPerformer.count = 2;
    sendBonds(
      null,
      Array.from({ length: 8 }, () => null),
    );
    velocity.hold(LEFT_HAND);
    controller.joinHands();
    expect(control.messagesOf("Bond").at(-1)?.limbs).toEqual([LEFT_HAND, 4 + RIGHT_HAND]);
  });
});
