import fc from "fast-check";
import { describe, expect, test } from "vitest";
import { layLabels, type Label } from "../../src/page/tag-layout";
import type { Box } from "../../src/stage/boxes";

const TOP = 60;
const WIDTH = 1440;

function bar(x: number, y: number): Box {
  return { left: x - 40, top: y - 10, right: x + 40, bottom: y + 10 };
}

function label(x: number, y: number, width = 140): Label {
  return { bar: bar(x, y), width, height: 26 };
}

function covers(a: Box, b: Box): boolean {
  return a.left < b.right && b.left < a.right && a.top < b.bottom && b.top < a.bottom;
}

describe("names by their bars", () => {
  test("stand above them, in the middle", () => {
    const [laid] = layLabels([label(700, 300)], [], [null], WIDTH, TOP);
    expect(laid).toEqual({ place: 0, box: { left: 630, right: 770, top: 252, bottom: 278 } });
  });

  test("are none where there is no bar", () => {
    expect(layLabels([null, null], [], [null, null], WIDTH, TOP)).toEqual([null, null]);
  });

  test("keep in the picture", () => {
    const [left, right] = layLabels([label(20, 300), label(1430, 300)], [], [null, null], WIDTH, TOP);
    expect(left?.box.left).toBe(8);
    expect(right?.box.right).toBe(WIDTH - 8);
  });

  test("go beside their bar where the header is above it", () => {
    const [laid] = layLabels([label(700, 80)], [], [null], WIDTH, TOP);
    expect(laid?.box.top).toBeGreaterThanOrEqual(TOP);
    expect(covers(laid!.box, bar(700, 80))).toBe(false);
  });

  test("cover neither one another nor a bar nor the face, wherever four bars that are apart hang", () => {
    const x = fc.integer({ min: 250, max: 1190 });
    const y = fc.integer({ min: 150, max: 260 });
    fc.assert(
      fc.property(fc.array(fc.tuple(x, y), { minLength: 4, maxLength: 4 }), (at) => {
        const bars = at.map(([x, y]) => bar(x, y));
        fc.pre(bars.every((one, nth) => bars.every((other, k) => k === nth || Math.abs(one.left - other.left) > 100)));
        const face = { left: 690, top: 300, right: 750, bottom: 400 };
        const laid = layLabels(at.map(([x, y]) => label(x, y)), [face], [null, null, null, null], WIDTH, TOP).map((one) => one!.box);
        laid.forEach((box, nth) => {
          expect([...bars, face, ...laid.filter((_, k) => k !== nth)].some((other) => covers(box, other))).toBe(false);
        });
      }),
      { examples: [[[[766, 208], [976, 208], [250, 150], [867, 215]]], [[[648, 150], [518, 210], [250, 210], [351, 217]]]] },
    );
  });

  test("stay where they went until there is room to spare", () => {
    const crowded = [label(700, 300), label(740, 262)];
    const first = layLabels(crowded, [], [null, null], WIDTH, TOP);
    expect(first[0]?.place).not.toBe(0);
    // the other bar goes up: just enough room is not enough to come back
    const little = layLabels([label(700, 300), label(740, 237)], [], first, WIDTH, TOP);
    expect(little[0]?.place).toBe(first[0]?.place);
    const much = layLabels([label(700, 300), label(740, 180)], [], little, WIDTH, TOP);
    expect(much[0]?.place).toBe(0);
  });

  test("cover as little as can be where there is no room at all", () => {
    const everywhere = { left: 0, top: 0, right: WIDTH, bottom: 900 };
    const [laid] = layLabels([label(700, 300)], [everywhere], [null], WIDTH, TOP);
    expect(laid).not.toBe(null);
  });

  test("of many stand clear of one another where there is room, and are laid within a frame where there is none", () => {
    const many = Array.from({ length: 16 }, (_, nth) => label(90 + (nth % 8) * 170, 250 + Math.floor(nth / 8) * 200, 110));
    const boxes = layLabels(many, [], [], WIDTH, TOP).map((one) => one!.box);
    boxes.forEach((box, nth) => expect([...many.map(({ bar }) => bar), ...boxes.filter((_, k) => k !== nth)].some((other) => covers(box, other))).toBe(false));
    const crowd = Array.from({ length: 16 }, (_, nth) => label(700 + nth, 300));
    const began = performance.now();
    expect(layLabels(crowd, [], [], WIDTH, TOP).every((one) => one !== null)).toBe(true);
    expect(performance.now() - began).toBeLessThan(500);
  });
});
