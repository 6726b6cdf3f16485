import fc from "fast-check";
import { describe, expect, test } from "vitest";
import { BUTTON, DEAD_ZONE, readPad, stick } from "../../src/input/gamepad-mapping";

const axis = fc.double({ min: -1, max: 1, noNaN: true });

function pad(axes: number[], pressed: Partial<Record<number, number>> = {}) {
  return { axes, buttons: Array.from({ length: 17 }, (_, i) => ({ pressed: (pressed[i] ?? 0) > 0.5, value: pressed[i] ?? 0 })) };
}

describe("a gamepad of the standard mapping", () => {
  test("sticks rest within the dead zone, rise from nothing at its edge, never pass 1, and keep their direction", () => {
    fc.assert(
      fc.property(axis, axis, (x, y) => {
        const [a, b] = stick(x, y);
        const length = Math.hypot(x, y);
        if (length <= DEAD_ZONE) expect([a, b]).toEqual([0, 0]);
        expect(Math.hypot(a, b)).toBeLessThanOrEqual(1 + 1e-9);
        expect(a * y - b * x).toBeCloseTo(0, 9);
      }),
    );
    expect(Math.hypot(...stick(DEAD_ZONE + 1e-6, 0))).toBeLessThan(1e-5);
    expect(stick(1, 0)).toEqual([1, 0]);
  });

  test("left stick moves the left hand, up is up; its trigger brings it nearer", () => {
    const { limbs } = readPad(pad([1, 0, 0, -1], { [BUTTON.left2]: 0.5 }));
    expect(limbs[0]).toEqual([1, -0, 0.5]);
    expect(limbs[1]).toEqual([0, 1, 0]);
    expect(limbs[2]).toEqual([0, 0, 0]);
  });

  test("a shoulder button gives the stick to the leg and turns the trigger outwards", () => {
    const { limbs } = readPad(pad([0.5, -1, 0, 0], { [BUTTON.left1]: 1, [BUTTON.left2]: 1 }));
    expect(limbs[0]).toEqual([0, 0, -1]);
    expect(limbs[2][1]).toBeGreaterThan(0.85);
    expect(limbs[3]).toEqual([0, 0, 0]);
  });

  test("play, seek, and a pad with fewer parts than the standard", () => {
    expect(readPad(pad([0, 0, 0, 0], { [BUTTON.play]: 1, [BUTTON.left]: 1 }))).toMatchObject({ play: true, seek: -1 });
    expect(readPad({ axes: [], buttons: [] })).toEqual({ limbs: [[0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0]], play: false, seek: 0 });
  });
});
