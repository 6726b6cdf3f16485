import { afterEach, beforeEach, describe, expect, test } from "vitest";
import { ClaimController } from "../../src/app/claim-controller";
import type { Playback } from "../../src/app/playback";
import { Puppeteer } from "../../src/client/puppeteer";
import { Viewer } from "../../src/client/viewer";
import type { LimbController } from "../../src/input/limb-controller";
import { DEFAULT_MAPPING } from "../../src/input/mapping";
import { VelocityInputs } from "../../src/input/velocity-input";
import type { LimbState } from "../../src/ui/limb-state";
import type { ToastAction } from "../../src/ui/notification/toast";
import type { Page } from "../../src/ui/page";
import { FakeWebSocket } from "../client/fake-websocket";
import { goldenDescription } from "../golden-motion";
import { createLimbController, type FakePuppeteer } from "../input/fake-puppeteer";
import { createStandingPuppet } from "../stage/puppet/figures";

const [LEFT_HAND, RIGHT_HAND] = [0, 1];
const PEOPLE = [
  { id: "a", name: "Aiko", colour: 0 },
  { id: "m", name: "Mateo", colour: 1 },
];

let holding: ClaimController;
let hands: LimbController;
let velocity: VelocityInputs;
let viewer: Viewer;
let puppeteer: Puppeteer;
let stream: FakeWebSocket;
let control: FakeWebSocket;
let toasts: [string, ToastAction | undefined][];
let notices: string[];
let shaken: number[];
let shown: readonly LimbState[];
let shownOf: number;
let key: string | null;
let cast: number[];

beforeEach(() => {
  FakeWebSocket.install();
  [toasts, notices, shaken, key] = [[], [], [], null];
  viewer = new Viewer({ url: "ws://stage/stream", now: () => 0, solver: () => new Promise(() => undefined) });
  stream = FakeWebSocket.last;
  stream.accept();
  puppeteer = new Puppeteer({ url: "ws://stage/control", viewer, now: () => 0 });
  control = FakeWebSocket.last;
  control.accept();
  const page = {
    strings: {
      render: (limbs: readonly LimbState[], _: boolean, chosen: number) => ([shown, shownOf] = [limbs, chosen]),
      notice: (text: string) => notices.push(text),
    },
    asks: { render: (_: unknown, gives: string | null) => (key = gives) },
    library: { danceAs: { dancers: (limbs: readonly LimbState[], chosen: number) => (cast = [limbs.length, chosen]) } },
    toast: (message: string, action?: ToastAction) => toasts.push([message, action]),
  };
  holding = new ClaimController(page as unknown as Page, () => DEFAULT_MAPPING);
  hands = createLimbController(createStandingPuppet(), puppeteer as unknown as FakePuppeteer);
  velocity = new VelocityInputs(hands, {
    claim: (limb) => holding.claim(limb, "velocity"),
    isFree: (limb) => holding.isFree(limb),
    selection: holding.selectedPerformer,
  });
  hands.onChange = () => holding.render();
  holding.stageInputs = { hands, velocity, shakeRing: (limb) => shaken.push(limb) };
  holding.setPlayback({ viewer, puppeteer } as unknown as Playback);
  holding.connected = true;
  control.receive({ name: "Welcome", id: "a", colour: 0, lead: 100_000 });
});
afterEach(() => {
  puppeteer.close();
  viewer.close();
  FakeWebSocket.remove();
});

/** What everyone is told. */
function presence(limbs: (string | null)[], asks: string[][] = [[], [], [], []]): void {
  for (const line of [stream, control]) line.receive({ name: "Presence", viewers: 2, puppeteers: PEOPLE, limbs, asks });
}

describe("a limb that another holds", () => {
  beforeEach(() => presence(["m", null, null, null]));

  test("is not taken by reaching for it: the ring shakes, its holder is named, and asking is offered", () => {
    expect(velocity.hold(LEFT_HAND)).toBe(false);
    expect([hands.source(LEFT_HAND), shaken, control.messagesOf("Claim")]).toEqual([null, [LEFT_HAND], []]);
    expect(toasts.map(([message, action]) => [message, action?.label, action?.key])).toEqual([
      ["Mateo holds the left hand", "Ask", "R"],
    ]);
    toasts[0][1]?.run();
    expect(control.messagesOf("Ask")).toEqual([{ name: "Ask", limb: LEFT_HAND, wanted: true }]);
    expect([shown[LEFT_HAND].requestedByMe, shown[RIGHT_HAND].requestedByMe]).toEqual([true, false]);
    velocity.hold(LEFT_HAND);
    expect(toasts.at(-1)).toEqual(["You ask Mateo for the left hand", undefined]);
  });

  test("is asked for by one key after reaching for it, and by none before", () => {
    holding.requestLimb();
    expect([toasts.at(-1)?.[0], control.messagesOf("Ask")]).toEqual([
      "Reach for a string that another holds, then ask for it",
      [],
    ]);
    holding.toggleClaim(LEFT_HAND);
    holding.requestLimb();
    expect(control.messagesOf("Ask")).toHaveLength(1);
    holding.withdrawRequest(LEFT_HAND);
    expect([control.messagesOf("Ask")[1].wanted, shown[LEFT_HAND].requestedByMe]).toEqual([false, false]);
  });

  test("once given is held and selected here", () => {
    holding.requestLimb(LEFT_HAND);
    presence(["m", null, null, null], [["a"], [], [], []]);
    control.receive({ name: "Grant", limb: LEFT_HAND, epoch: 4 });
    expect([velocity.holds(LEFT_HAND), velocity.selectedLimb]).toEqual([true, LEFT_HAND]);
    presence(["a", null, null, null]);
    expect(shown[LEFT_HAND]).toMatchObject({ holder: { name: "You", mine: true }, asked: false, selected: true });
    expect([toasts.at(-1)?.[0], control.messagesOf("Claim"), control.messagesOf("Release")]).toEqual([
      "The left hand is yours",
      [],
      [],
    ]);
  });

  test("not given, or free, is said so", () => {
    holding.requestLimb(LEFT_HAND);
    presence(["m", null, null, null], [["a"], [], [], []]);
    presence(["m", null, null, null]);
    holding.requestLimb(LEFT_HAND);
    presence([null, null, null, null]);
    expect(toasts.map(([message]) => message)).toEqual([
      "You ask Mateo for the left hand",
      "The left hand was not given",
      "You ask Mateo for the left hand",
      "The left hand is free now",
    ]);
  });
});

describe("one's own limb that another asks for", () => {
  beforeEach(() => {
    for (const limb of [RIGHT_HAND, LEFT_HAND]) {
      velocity.hold(limb);
      control.receive({ name: "Grant", limb, epoch: 7 + limb });
    }
  });

  test("stays until it is given, by one key", () => {
    presence(["a", "a", null, null], [[], ["m"], [], []]);
    expect([shown[RIGHT_HAND].requesters.map(({ name }) => name), shown[LEFT_HAND].requesters, key]).toEqual([
      ["Mateo"],
      [],
      "G",
    ]);
    expect(velocity.holds(RIGHT_HAND)).toBe(true);
    holding.handOver();
    expect(control.messagesOf("Release")).toEqual([{ name: "Release", limb: RIGHT_HAND, epoch: 8 }]);
    expect([hands.source(RIGHT_HAND), hands.source(LEFT_HAND)]).toEqual([null, "velocity"]);
  });

  test("of several the selected one is given first, and of none nothing", () => {
    holding.handOver();
    expect([toasts.at(-1)?.[0], control.messagesOf("Release")]).toEqual(["Nobody asks for a string of yours", []]);
    presence(["a", "a", null, null], [["m"], ["m"], [], []]);
    expect(velocity.selectedLimb).toBe(LEFT_HAND);
    holding.handOver();
    expect(control.messagesOf("Release").map(({ limb }) => limb)).toEqual([LEFT_HAND]);
  });
});

test("a limb claimed in the same moment by another is said to be theirs when the session refuses it", () => {
  presence([null, null, null, null]);
  velocity.hold(LEFT_HAND);
  presence(["m", null, null, null]);
  control.receive({ name: "Refusal", limb: LEFT_HAND, reason: "held", holder: "m" });
  expect([hands.source(LEFT_HAND), toasts.at(-1)?.[0]]).toEqual([null, "Mateo holds the left hand"]);
});

test("notices become a line in the card, and no toast", () => {
  control.receive({ name: "Notice", limb: 0, reason: "reach", detail: "out of reach" });
  expect([notices, toasts]).toEqual([["out of reach"], []]);
});

describe("several performers", () => {
  const SECOND = 4;

  /** The motion on the stage has so many. */
  function dance(motion: string, performers: number): void {
    stream.receive({
      name: "Description",
      motion,
      first: null,
      tracks: Array.from({ length: performers }, () => goldenDescription()),
    });
  }
  beforeEach(() => dance("two", 2));

  test("have four limbs each, held and named by whose they are", () => {
    presence([null, null, null, null, "m", null, null, null], Array(8).fill([]));
    expect([shown.length, shown[0].holder, shown[SECOND].holder?.name]).toEqual([8, null, "Mateo"]);
    holding.selectedPerformer.select(1);
    expect([shownOf, cast]).toEqual([1, [8, 1]]);
    velocity.hold(velocity.limb(LEFT_HAND));
    expect(toasts.at(-1)?.[0]).toBe("Mateo holds the left hand of dancer 2");
    expect(shaken).toEqual([SECOND + LEFT_HAND]);
    holding.requestLimb();
    expect(control.messagesOf("Ask")).toEqual([{ name: "Ask", limb: SECOND + LEFT_HAND, wanted: true }]);
  });

  test("the next one is chosen by a key, and said, round and round; one alone is not spoken of", () => {
    holding.selectNextPerformer();
    holding.selectNextPerformer();
    expect(toasts.map(([message]) => message)).toEqual(["Dancer 2 of 2", "Dancer 1 of 2"]);
    dance("one", 1);
    holding.selectNextPerformer();
    expect(toasts).toHaveLength(2);
  });

  test("limbs of who goes are let go, and what the session tells of more or fewer is no matter", () => {
    velocity.hold(SECOND + RIGHT_HAND);
    velocity.hold(LEFT_HAND);
    control.receive({ name: "Grant", limb: SECOND + RIGHT_HAND, epoch: 3 });
    holding.selectedPerformer.select(1);
    dance("one", 1);
    expect([
      hands.source(SECOND + RIGHT_HAND),
      hands.source(LEFT_HAND),
      holding.selectedPerformer.performer,
      shown.length,
    ]).toEqual([null, "velocity", 0, 4]);
    expect(control.messagesOf("Release")).toEqual([{ name: "Release", limb: SECOND + RIGHT_HAND, epoch: 3 }]);
    presence(["a", null, null, null, "m", null, null, null], [[], [], [], [], ["a"], [], [], []]);
    control.receive({ name: "Refusal", limb: SECOND, reason: "unknown", holder: null });
    holding.requestLimb(SECOND);
    holding.handOver(SECOND);
    expect([holding.isFree(SECOND), shown.length]).toEqual([false, 4]);
    dance("three", 3);
    expect(shown.length).toBe(12);
  });
});
