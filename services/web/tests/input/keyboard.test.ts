import { afterEach, beforeEach, describe, expect, test, vi } from "vitest";
import { CommandDispatcher } from "../../src/input/command-dispatcher";
import { listenToKeyboard } from "../../src/input/keyboard";
import type { LimbController } from "../../src/input/limb-controller";
import { bind, DEFAULT_MAPPING, type Mapping } from "../../src/input/mapping";
import { VelocityInputs } from "../../src/input/velocity-input";
import { createStandingPuppet } from "../stage/puppet/figures";
import { createLimbController, FakePuppeteer } from "./fake-puppeteer";
import { recordPageActions } from "./page-actions";

const LEFT_HAND = 0;

/** As much of an element as is asked of the one with the focus. */
class Focused extends EventTarget {
  isContentEditable = false;
  constructor(private readonly kind: string) {
    super();
  }
  matches(selector: string): boolean {
    return this.kind === "input" && selector.includes("input");
  }
  closest(selector: string): Focused | null {
    return this.kind === "button" && selector.includes("button") ? this : null;
  }
}

let target: EventTarget;
let hands: LimbController;
let velocity: VelocityInputs;
let session: FakePuppeteer;
let told: string[];
let dialog: boolean;
let mapping: Mapping;

/** A key goes down; whether it was taken from the browser. */
function down(code: string, more: Record<string, unknown> = {}): boolean {
  const event = Object.assign(
    new Event("keydown", { cancelable: true }),
    { code, key: code, repeat: false, ctrlKey: false, metaKey: false, altKey: false },
    more,
  );
  if ("focus" in more) Object.defineProperty(event, "target", { value: more.focus });
  target.dispatchEvent(event);
  return event.defaultPrevented;
}

function up(code: string): void {
  target.dispatchEvent(Object.assign(new Event("keyup"), { code }));
}

function tap(code: string): boolean {
  const taken = down(code);
  up(code);
  return taken;
}

beforeEach(() => {
  vi.stubGlobal("HTMLElement", Focused);
  vi.stubGlobal("Element", Focused);
  vi.stubGlobal("document", { querySelector: () => (dialog ? {} : null) });
  target = new EventTarget();
  session = new FakePuppeteer();
  hands = createLimbController(createStandingPuppet(), session);
  told = [];
  dialog = false;
  mapping = DEFAULT_MAPPING;
  velocity = new VelocityInputs(hands, {
    claim: (limb) => hands.claim(limb, "velocity"),
    isFree: (limb) => hands.source(limb) === null,
  });
  const actions = { showKeys: () => told.push("keys"), onEscape: () => told.push("escape") };
  listenToKeyboard(
    target as unknown as Window,
    new CommandDispatcher(hands, velocity, recordPageActions(told)),
    velocity,
    () => mapping,
    actions,
  );
});
afterEach(() => vi.unstubAllGlobals());

describe("with no string held", () => {
  test("arrows seek, letters open panels, other keys are the browser's", () => {
    expect(["ArrowRight", "KeyS", "KeyK", "Space", "KeyZ", "KeyW"].map(tap)).toEqual([
      true,
      true,
      true,
      true,
      false,
      false,
    ]);
    expect(told).toEqual(["forward", "strings", "keep", "play"]);
  });

  test("a held arrow seeks on, a held letter opens once", () => {
    down("ArrowLeft");
    down("ArrowLeft", { repeat: true });
    down("KeyL");
    down("KeyL", { repeat: true });
    expect(told).toEqual(["back", "back", "library"]);
  });

  test("Escape shuts, ? shows the keys", () => {
    tap("Escape");
    down("Slash", { key: "?" });
    expect(told).toEqual(["escape", "keys"]);
  });
});

describe("with a string held", () => {
  beforeEach(() => {
    tap("Digit2");
    session.takeCalls();
  });

  test("the same keys pull it, at once and several together, until they come up", () => {
    expect([down("KeyS"), down("ArrowRight")]).toEqual([true, true]);
    velocity.update(0);
    const [[, limb, right, upwards]] = session.takeCalls();
    expect([limb, right, upwards]).toEqual([
      LEFT_HAND,
      Math.round(32 * Math.SQRT1_2) / 32,
      -Math.round(32 * Math.SQRT1_2) / 32,
    ]);
    up("KeyS");
    velocity.update(16);
    expect(session.takeCalls()).toEqual([["velocity", LEFT_HAND, 1, 0, 0]]);
    target.dispatchEvent(new Event("blur"));
    velocity.update(32);
    expect(session.takeCalls()).toEqual([["velocity", LEFT_HAND, 0, 0, 0]]);
    expect(told).toEqual([]);
  });

  test("of an element they are up when the focus leaves it", () => {
    const commands = new CommandDispatcher(hands, velocity, recordPageActions(told));
    target = Object.assign(new EventTarget(), { tagName: "DIV" });
    listenToKeyboard(target as unknown as HTMLElement, commands, velocity, () => mapping, {
      showKeys: () => undefined,
      onEscape: () => undefined,
    });
    down("ArrowUp");
    velocity.update(0);
    expect(session.takeCalls()).toEqual([["velocity", LEFT_HAND, 0, 1, 0]]);
    target.dispatchEvent(new Event("focusout"));
    velocity.update(16);
    expect(session.takeCalls()).toEqual([["velocity", LEFT_HAND, 0, 0, 0]]);
  });

  test("Escape lets go and shuts nothing; a key still down does nothing else then", () => {
    down("KeyS");
    tap("Escape");
    down("KeyS", { repeat: true });
    expect([hands.source(LEFT_HAND), told]).toEqual([null, []]);
    up("KeyS");
    tap("KeyS");
    expect(told).toEqual(["strings"]);
  });
});

test("keys are the browser's in a text, with Ctrl, in a dialog, and Space on a button", () => {
  expect(down("KeyL", { focus: new Focused("input") })).toBe(false);
  expect(down("KeyL", { ctrlKey: true })).toBe(false);
  expect(down("Space", { focus: new Focused("button") })).toBe(false);
  dialog = true;
  expect(down("KeyL")).toBe(false);
  dialog = false;
  expect(down("KeyL", { focus: new Focused("button") })).toBe(true);
  expect(told).toEqual(["library"]);
});

test("a key bound anew takes its limb by a push", () => {
  mapping = bind(DEFAULT_MAPPING, "KeyU", "right_leg+");
  down("KeyU");
  velocity.update(0);
  expect(session.takeCalls()).toEqual([
    ["claim", 3],
    ["velocity", 3, 1, 0, 0],
  ]);
});
