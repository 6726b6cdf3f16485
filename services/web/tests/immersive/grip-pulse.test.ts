import { expect, test } from "vitest";
import { GripPulses, pulseFor } from "../../src/immersive/grip-pulse";
import type { HandGrip } from "../../src/input/hand";

test("a string that is taken is felt, and stronger one that is refused or lost", () => {
  const strength = (...kinds: [HandGrip["kind"], HandGrip["kind"]]) => pulseFor(...kinds)?.[0] ?? 0;
  expect(strength("open", "holding")).toBeGreaterThan(0);
  expect(strength("open", "asking")).toBeGreaterThan(strength("open", "holding"));
  expect(strength("holding", "empty")).toBeGreaterThan(strength("open", "holding"));
  for (const [before, now] of [
    ["open", "empty"],
    ["holding", "open"],
    ["asking", "open"],
    ["holding", "holding"],
  ] as const)
    expect(pulseFor(before, now)).toBe(null);
});

test("each change is one pulse of that hand, if its controller has an actuator", () => {
  const pulses: string[] = [];
  const gamepad = (name: string) => ({
    hapticActuators: [{ pulse: (strength: number) => Promise.resolve(pulses.push(`${name} ${strength}`)) }],
  });
  const gamepads: Record<string, unknown> = { left: gamepad("left"), right: { hapticActuators: [] } };
  const grips = new GripPulses();
  const update = (left: HandGrip["kind"]) =>
    grips.update(
      [
        { name: "left", kind: left, limb: 0 },
        { name: "right", kind: left, limb: 1 },
        { name: "none", kind: left, limb: 2 },
      ],
      (name) => (gamepads[name] ?? null) as Gamepad | null,
    );
  for (const kind of ["open", "holding", "holding", "open", "asking"] as const) update(kind);
  expect(pulses).toEqual(["left 0.5", "left 1"]);
});
