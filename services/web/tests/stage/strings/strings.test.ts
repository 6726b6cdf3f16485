import { type InstancedBufferGeometry, type Mesh, Vector3 } from "three";
import { describe, expect, test } from "vitest";
import { LOOKS } from "../../../src/stage/scenery/look";
import { type StringState, Strings } from "../../../src/stage/strings/strings";

const FREE: StringState = { puppeteer: null, isHighlighted: false, pullTarget: null };
const RIGHT = new Vector3(1, 0, 0);

/** Return the bars at rest for limbs with handles at these positions, held where a puppeteer is given. */
function barsFor(
  handles: readonly [number, number][],
  puppeteers: readonly (number | null)[],
  sides?: readonly [number, number],
): (Vector3 | null)[] {
  const strings = new Strings();
  strings.reducedMotion = true;
  const puppet = { scale: 1, handle: (limb: number, out: Vector3) => out.set(...handles[limb], 0) };
  const states = puppeteers.map((puppeteer) => ({ ...FREE, puppeteer }));
  const view = { ground: 0, ceiling: 2.6, right: RIGHT, distanceScale: 1, ...(sides && { sides }) };
  strings.update([puppet], states, LOOKS.night, 0.016, view);
  return [0, 1, 2, 3].map((limb) => strings.barPosition(limb)?.clone() ?? null);
}

describe("bars", () => {
  test("hang over held limbs only", () => {
    const [left, right, ...legs] = barsFor(
      [
        [0.6, 1.2],
        [-0.6, 1.2],
        [0.1, 0.5],
        [-0.1, 0.5],
      ],
      [0, null, null, null],
    );
    expect(left?.x).toBeCloseTo(0.68, 9);
    expect(left?.y).toBeCloseTo(2.14, 9);
    expect([right, ...legs]).toEqual([null, null, null]);
  });

  test("move apart evenly", () => {
    const bars = barsFor(
      [
        [0, 1.2],
        [0, 1.2],
        [0, 0.5],
        [0, 0.5],
      ],
      [0, 1, 2, 3],
    ).map((bar) => bar!);
    const places = bars.map(({ x }) => x).sort((a, b) => a - b);
    places.slice(1).forEach((x, nth) => expect(x - places[nth]).toBeGreaterThan(0.359));
    expect(places.reduce((sum, x) => sum + x, 0)).toBeCloseTo(0, 9);
  });

  test("hang in the uncovered part of the picture, unless their handles are covered", () => {
    const handles: [number, number][] = [
      [0.6, 1.2],
      [-0.6, 1.2],
      [0.1, 0.5],
      [-0.1, 0.5],
    ];
    const [left, right] = barsFor(handles, [0, 1, null, null], [-0.62, 0.65]);
    expect(left?.x).toBeCloseTo(0.45, 9);
    expect(right?.x).toBeCloseTo(-0.42, 9);
    expect(barsFor(handles, [0, null, null, null], [-0.5, 0.5])[0]?.x).toBeCloseTo(0.68, 9);
  });

  test("at different heights stay over their limbs", () => {
    const bars = barsFor(
      [
        [0, 2.2],
        [0, 1.2],
        [0, 0.5],
        [0, 0.5],
      ],
      [0, 1, null, null],
    );
    expect(bars[0]?.x).toBeCloseTo(0.08, 9);
    expect(bars[1]?.x).toBeCloseTo(-0.08, 9);
  });
});

describe("strings of several performers", () => {
  const place = (x: number) => ({ scale: 1, handle: (_: number, out: Vector3) => out.set(x, 1, 0) });
  const view = { ground: 0, ceiling: 2.6, right: RIGHT, distanceScale: 1 };
  const rings = (strings: Strings) => strings.group.getObjectByName("rings") as Mesh<InstancedBufferGeometry>;
  const values = (strings: Strings, name: string, limb: number) => {
    const attribute = rings(strings).geometry.getAttribute(name);
    return Array.from({ length: attribute.itemSize }, (_, i) => attribute.getComponent(limb, i));
  };

  test("are four each, and hidden for a missing performer", () => {
    const strings = new Strings();
    strings.reducedMotion = true;
    const states: StringState[] = [];
    states[9] = { ...FREE, puppeteer: 2 };
    strings.update([place(-2), null, place(2)], states, LOOKS.night, 0.016, view);
    expect(rings(strings).geometry.instanceCount).toBe(12);
    expect(values(strings, "place", 3)).toEqual([-2, 1, 0]);
    expect(values(strings, "tint", 4)[3]).toBe(0);
    expect(values(strings, "place", 11)).toEqual([2, 1, 0]);
    expect([0, 4, 8, 9, 10].map((limb) => strings.barPosition(limb) !== null)).toEqual([
      false,
      false,
      false,
      true,
      false,
    ]);
    strings.update([place(0)], [], LOOKS.night, 0.016, view);
    expect(rings(strings).geometry.instanceCount).toBe(4);
  });

  test("are dimmed unless selected or highlighted, and larger at a distance", () => {
    const strings = new Strings();
    strings.reducedMotion = true;
    const dimmed = { ...FREE, isDimmed: true };
    strings.update(
      [place(0), place(1)],
      [FREE, FREE, FREE, FREE, dimmed, { ...dimmed, isHighlighted: true }],
      LOOKS.night,
      0.016,
      { ...view, distanceScale: 4 },
    );
    const [own, other, lit] = [0, 4, 5].map((limb) => values(strings, "tint", limb)[3]);
    expect(other).toBeLessThan(0.5 * own);
    expect([own, lit]).toEqual([expect.closeTo(LOOKS.night.ringOpacity, 6), 1]);
    expect(values(strings, "shape", 0)[0]).toBeCloseTo(0.092, 6);
  });
});

test("pulls of the audience are drawn as a bounded number of threads", () => {
  const strings = new Strings();
  const puppet = { scale: 1, handle: (limb: number, out: Vector3) => out.set(limb, 1, 0) };
  const view = { ground: 0, ceiling: 2.6, right: RIGHT, distanceScale: 1 };
  const threads = () =>
    (strings.group.children.filter(({ name }) => name === "threads") as Mesh<InstancedBufferGeometry>[]).map(
      ({ geometry }) => geometry.instanceCount,
    );
  const open: StringState = { ...FREE, isOpen: true, crowdThreads: Array.from({ length: 16 }, () => new Vector3()) };
  strings.update([puppet], [open, FREE, FREE, FREE], LOOKS.night, 0.016, view);
  expect(threads()).toEqual([4, 16]);
  strings.update([puppet, puppet], Array<StringState>(8).fill(open), LOOKS.night, 0.016, view);
  expect(threads()).toEqual([8, 64]);
  strings.update([puppet], [FREE, FREE, FREE, FREE], LOOKS.night, 0.016, view);
  expect(threads()).toEqual([4, 0]);
});
