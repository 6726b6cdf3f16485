import fc from "fast-check";
import { describe, expect, test } from "vitest";
import { DIGITAL_INPUTS, SELECTED_LIMB_INPUTS } from "../../src/input/digital-input";
import {
  ACTIONS,
  bind,
  type Command,
  conflictsOf,
  controlsOf,
  DEFAULT_MAPPING,
  isPadControl,
  limbOfCommand,
  type Mapping,
  parseMapping,
  unbind,
} from "../../src/input/mapping";

const ALL: readonly Command[] = [...DIGITAL_INPUTS, ...SELECTED_LIMB_INPUTS, ...ACTIONS];
const command = fc.constantFrom(...ALL);
const control = fc.constantFrom("KeyZ", "KeyW", "Digit1", "button:1", "axis:0+", "button:4 button:1", "F2");

describe("the default mapping", () => {
  test("survives serialisation", () => {
    expect(parseMapping(JSON.parse(JSON.stringify(DEFAULT_MAPPING)))).toEqual(DEFAULT_MAPPING);
  });

  test("has no conflicts", () => {
    for (const [key, commands] of Object.entries(DEFAULT_MAPPING.bindings)) {
      for (const does of commands) expect(conflictsOf(DEFAULT_MAPPING, key, does), `${key} ${does}`).toEqual([]);
    }
  });

  test("reaches all limbs by gamepad, and all limbs and actions by keyboard", () => {
    for (const input of DIGITAL_INPUTS) expect(controlsOf(DEFAULT_MAPPING, input).some(isPadControl), input).toBe(true);
    for (const key of [...SELECTED_LIMB_INPUTS, ...ACTIONS])
      expect(
        controlsOf(DEFAULT_MAPPING, key).some((key) => !isPadControl(key)),
        key,
      ).toBe(true);
  });
});

describe("editing", () => {
  test("binds and unbinds one command and changes nothing else", () => {
    fc.assert(
      fc.property(fc.array(fc.tuple(control, command), { maxLength: 12 }), control, command, (before, at, does) => {
        const mapping = before.reduce((sum, [key, other]) => bind(sum, key, other), DEFAULT_MAPPING);
        const bound = bind(mapping, at, does);
        expect(controlsOf(bound, does)).toContain(at);
        expect(parseMapping(JSON.parse(JSON.stringify(bound)))).toEqual(bound);
        const back = unbind(bound, at, does);
        expect(controlsOf(back, does)).not.toContain(at);
        for (const other of ALL)
          if (other !== does) expect(new Set(controlsOf(back, other))).toEqual(new Set(controlsOf(mapping, other)));
      }),
    );
  });

  test("a conflict is a second command at the same time", () => {
    const twice = bind(DEFAULT_MAPPING, "Space", "keep");
    expect(conflictsOf(twice, "Space", "keep")).toEqual(["play"]);
    expect(conflictsOf(twice, "Space", "play")).toEqual(["keep"]);
    expect(conflictsOf(bind(DEFAULT_MAPPING, "KeyW", "keep"), "KeyW", "keep")).toEqual([]);
    expect(conflictsOf(bind(DEFAULT_MAPPING, "KeyW", "held_x+"), "KeyW", "held_x+")).toEqual(["held_y+"]);
  });

  test("an unbound chord stays silent, an unbound single control is removed", () => {
    expect(unbind(DEFAULT_MAPPING, "button:4 button:6", "left_hand_z-").bindings["button:4 button:6"]).toEqual([]);
    expect("KeyK" in unbind(DEFAULT_MAPPING, "KeyK", "keep").bindings).toBe(false);
  });
});

describe("unvalidated data", () => {
  const broken: [string, unknown][] = [
    ["null", null],
    ["a number", 7],
    ["a list", []],
    ["no bindings", { ...DEFAULT_MAPPING, bindings: undefined }],
    ["a list of bindings", { ...DEFAULT_MAPPING, bindings: [] }],
    ["an unknown command", { ...DEFAULT_MAPPING, bindings: { KeyW: ["fly"] } }],
    ["commands that are no list", { ...DEFAULT_MAPPING, bindings: { KeyW: "play" } }],
    ["an unknown control", { ...DEFAULT_MAPPING, bindings: { "wheel:1": ["play"] } }],
    [
      "too many controls",
      { ...DEFAULT_MAPPING, bindings: Object.fromEntries(Array.from({ length: 401 }, (_, i) => [`K${i}`, []])) },
    ],
    ["a dead zone of 1", { ...DEFAULT_MAPPING, deadZone: 1 }],
    ["no dead zone", { ...DEFAULT_MAPPING, deadZone: undefined }],
    ["negative smoothing", { ...DEFAULT_MAPPING, stickSmoothing: -0.1 }],
    ["smoothing as text", { ...DEFAULT_MAPPING, pointerSmoothing: "much" }],
  ];
  test.each(broken)("is rejected: %s", (_, value) => {
    expect(parseMapping(value)).toBeNull();
  });

  test("gives a mapping or null, never an error", () => {
    fc.assert(
      fc.property(fc.anything(), fc.anything(), (value, bindings) => {
        for (const key of [value, { ...DEFAULT_MAPPING, bindings }]) {
          const read: Mapping | null = parseMapping(key);
          if (read) expect(parseMapping(read)).toEqual(read);
        }
      }),
    );
  });
});

test("four actions claim one limb each", () => {
  expect(ACTIONS.map(limbOfCommand).filter((limb) => limb !== null)).toEqual([1, 0, 3, 2]);
  expect(limbOfCommand("held_x+")).toBeNull();
});
