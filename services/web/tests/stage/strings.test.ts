import { Vector3 } from "three";
import { describe, expect, test } from "vitest";
import { LOOKS } from "../../src/stage/look";
import type { Puppet } from "../../src/stage/puppet";
import { Strings, type StringState } from "../../src/stage/strings";

const FREE: StringState = { holder: null, lit: false, pull: null };
const RIGHT = new Vector3(1, 0, 0);

/** Bars once they hang still, of limbs whose handles are at these places, held where a holder is given. */
function hung(handles: readonly [number, number][], holders: readonly (number | null)[]): (Vector3 | null)[] {
  const strings = new Strings();
  strings.still = true;
  const puppet = { scale: 1, handle: (limb: number, out: Vector3) => out.set(...handles[limb], 0) };
  const states = holders.map((holder) => ({ ...FREE, holder }));
  strings.update(puppet as unknown as Puppet, states, LOOKS.night, 0.016, 0, 2.6, RIGHT);
  return [0, 1, 2, 3].map((limb) => strings.bar(limb)?.clone() ?? null);
}

describe("bars", () => {
  test("hang over the limbs that are held, and over no others", () => {
    const [left, right, ...legs] = hung([[0.6, 1.2], [-0.6, 1.2], [0.1, 0.5], [-0.1, 0.5]], [0, null, null, null]);
    expect(left?.x).toBeCloseTo(0.68, 9);
    expect(left?.y).toBeCloseTo(2.14, 9);
    expect([right, ...legs]).toEqual([null, null, null]);
  });

  test("go aside for one another, each as far", () => {
    const bars = hung([[0, 1.2], [0, 1.2], [0, 0.5], [0, 0.5]], [0, 1, 2, 3]).map((bar) => bar!);
    const places = bars.map(({ x }) => x).sort((a, b) => a - b);
    places.slice(1).forEach((x, nth) => expect(x - places[nth]).toBeGreaterThan(0.359));
    expect(places.reduce((sum, x) => sum + x, 0)).toBeCloseTo(0, 9);
  });

  test("at heights of their own stay over their limbs", () => {
    const bars = hung([[0, 2.2], [0, 1.2], [0, 0.5], [0, 0.5]], [0, 1, null, null]);
    expect(bars[0]?.x).toBeCloseTo(0.08, 9);
    expect(bars[1]?.x).toBeCloseTo(-0.08, 9);
  });
});
