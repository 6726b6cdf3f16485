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

/** Minimal element that can have the focus. */
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
let limbController: LimbController;
let velocity: VelocityInputs;
let session: FakePuppeteer;
let actions: string[];
let dialog: boolean;
let mapping: Mapping;

/** Press a key; return whether its default action was prevented. */
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
  limbController = createLimbController(createStandingPuppet(), session);
  actions = [];
  dialog = false;
  mapping = DEFAULT_MAPPING;
  velocity = new VelocityInputs(limbController, {
    claim: (limb) => limbController.claim(limb, "velocity"),
    isFree: (limb) => limbController.source(limb) === null,
  });
  const keyboardActions = { showKeys: () => actions.push("keys"), onEscape: () => actions.push("escape") };
  listenToKeyboard(
    target as unknown as Window,
    new CommandDispatcher(limbController, velocity, recordPageActions(actions)),
    velocity,
    () => mapping,
    keyboardActions,
  );
});
afterEach(() => vi.unstubAllGlobals());

describe("with no limb held", () => {
  test("arrows seek, letters open panels, other keys are left to the browser", () => {
    expect(["ArrowRight", "KeyS", "KeyK", "Space", "KeyZ", "KeyW"].map(tap)).toEqual([
      true,
      true,
      true,
      true,
      false,
      false,
    ]);
    expect(actions).toEqual(["forward", "strings", "keep", "play"]);
  });

  test("a held arrow keeps seeking, a held letter opens once", () => {
    down("ArrowLeft");
    down("ArrowLeft", { repeat: true });
    down("KeyL");
    down("KeyL", { repeat: true });
    expect(actions).toEqual(["back", "back", "library"]);
  });

  test("Escape closes panels, ? shows the keys", () => {
    tap("Escape");
    down("Slash", { key: "?" });
    expect(actions).toEqual(["escape", "keys"]);
  });
});

describe("with a limb held", () => {
  beforeEach(() => {
    tap("Digit2");
    session.takeCalls();
  });

  test("the same keys move it, combined, until released", () => {
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
    expect(actions).toEqual([]);
  });

  test("keys of an element are released when it loses the focus", () => {
    const commands = new CommandDispatcher(limbController, velocity, recordPageActions(actions));
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

  test("Escape releases it and closes nothing; held keys do nothing then", () => {
    down("KeyS");
    tap("Escape");
    down("KeyS", { repeat: true });
    expect([limbController.source(LEFT_HAND), actions]).toEqual([null, []]);
    up("KeyS");
    tap("KeyS");
    expect(actions).toEqual(["strings"]);
  });
});

test("keys are left to text fields, Ctrl, dialogs, and Space to buttons", () => {
  expect(down("KeyL", { focus: new Focused("input") })).toBe(false);
  expect(down("KeyL", { ctrlKey: true })).toBe(false);
  expect(down("Space", { focus: new Focused("button") })).toBe(false);
  dialog = true;
  expect(down("KeyL")).toBe(false);
  dialog = false;
  expect(down("KeyL", { focus: new Focused("button") })).toBe(true);
  expect(actions).toEqual(["library"]);
});

test("a newly bound key claims its limb by a push", () => {
  mapping = bind(DEFAULT_MAPPING, "KeyU", "right_leg+");
  down("KeyU");
  velocity.update(0);
  expect(session.takeCalls()).toEqual([
    ["claim", 3],
    ["velocity", 3, 1, 0, 0],
  ]);
});
