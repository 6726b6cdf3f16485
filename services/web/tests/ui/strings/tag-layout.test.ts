import fc from "fast-check";
import { describe, expect, test } from "vitest";
import { overlaps, type ScreenBox } from "../../../src/stage/camera/screen-box";
import {
  type LabelPlacement,
  type LabelViewport,
  layOutLabels,
  placeBeside,
  type TagLabel,
} from "../../../src/ui/strings/tag-layout";

const PICTURE: LabelViewport = { width: 1440, height: 900, top: 60 };
const SIZES = [
  { width: 140, height: 26 },
  { width: 70, height: 26 },
  { width: 22, height: 22 },
];
/** Forms of a tag: whole, the name alone, its initial. */
const [WHOLE, NAME, INITIAL] = [0, 1, 2];

function bar(x: number, y: number): ScreenBox {
  return { left: x - 40, top: y - 10, right: x + 40, bottom: y + 10 };
}

function label(x: number, y: number, rank = 0, sizes = SIZES): TagLabel {
  return { bar: bar(x, y), sizes, rank };
}

const lay = (
  labels: readonly (TagLabel | null)[],
  obstacles: readonly ScreenBox[] = [],
  previous: readonly (LabelPlacement | null)[] = [],
  now = 0,
  picture = PICTURE,
) => layOutLabels(labels, obstacles, previous, picture, now);
const sizesOf = (placements: readonly (LabelPlacement | null)[]) =>
  placements.map((one) => one && (one.box ? one.size : null));

/** Return the boxes that are outside the picture, or cover another tag, a bar or an obstacle. */
function misplacedBoxes(
  placements: readonly (LabelPlacement | null)[],
  labels: readonly (TagLabel | null)[],
  obstacles: readonly ScreenBox[],
  { width, height, top }: LabelViewport,
): ScreenBox[] {
  const boxes = placements.flatMap((one) => one?.box ?? []);
  const bars = labels.flatMap((one) => one?.bar ?? []);
  return boxes.filter((box, index) => {
    const within = box.left >= 0 && box.right <= width && box.top >= top && box.bottom <= height;
    return (
      !within || [...obstacles, ...bars, ...boxes.filter((_, k) => k !== index)].some((other) => overlaps(box, other))
    );
  });
}

describe("tags beside their bars", () => {
  test("are centred above them, in the longest form", () => {
    const [placements] = lay([label(700, 300)]);
    expect(placements).toEqual({
      size: WHOLE,
      place: 0,
      upgradableSinceMs: null,
      box: { left: 630, right: 770, top: 252, bottom: 278 },
    });
  });

  test("are hidden without a bar, or with a bar outside the picture", () => {
    expect(lay([null, null])).toEqual([null, null]);
    expect(lay([label(-60, 300), label(700, 930)]).map((one) => one?.box)).toEqual([null, null]);
  });

  test("stay inside the picture", () => {
    const [left, right] = lay([label(20, 300), label(1430, 300)]);
    expect(left?.box?.left).toBe(8);
    expect(right?.box?.right).toBe(PICTURE.width - 8);
  });

  test("are beside the bar if the header is above it", () => {
    const [placements] = lay([label(700, 80)]);
    expect(placements?.box?.top).toBeGreaterThanOrEqual(PICTURE.top);
    expect(overlaps(placements!.box!, bar(700, 80))).toBe(false);
  });

  test("are hidden without space for the shortest form", () => {
    const everywhere = { left: 0, top: 0, right: PICTURE.width, bottom: PICTURE.height };
    expect(lay([label(700, 300)], [everywhere])[0]?.box).toBe(null);
  });

  test("of four strings have the longest form on a wide stage", () => {
    expect(sizesOf(lay([label(620, 200), label(730, 200), label(840, 200), label(700, 240)]))).toEqual([
      WHOLE,
      WHOLE,
      WHOLE,
      WHOLE,
    ]);
  });
});

describe("many tags", () => {
  /**
   * Window, obstacles, and up to sixteen bars with tags of different lengths and ranks, which move from frame to
   * frame.
   */
  const scenes = fc.record({
    width: fc.integer({ min: 320, max: 1600 }),
    height: fc.integer({ min: 320, max: 1000 }),
    header: fc.integer({ min: 0, max: 90 }),
    strings: fc.array(
      fc.record({
        x: fc.double({ min: -0.05, max: 1.05, noNaN: true }),
        y: fc.double({ min: 0.05, max: 0.6, noNaN: true }),
        long: fc.integer({ min: 40, max: 260 }),
        rank: fc.integer({ min: 0, max: 2 }),
        held: fc.boolean(),
      }),
      { minLength: 1, maxLength: 16 },
    ),
    faces: fc.array(
      fc.record({
        x: fc.double({ min: 0, max: 1, noNaN: true }),
        y: fc.double({ min: 0.1, max: 0.7, noNaN: true }),
        size: fc.integer({ min: 6, max: 60 }),
      }),
      { maxLength: 4 },
    ),
    moves: fc.array(
      fc.tuple(fc.integer({ min: -30, max: 30 }), fc.integer({ min: -20, max: 20 }), fc.integer({ min: 0, max: 1000 })),
      { maxLength: 6 },
    ),
  });

  test("never cover tags, bars, faces or obstacles, nor leave the window", () => {
    fc.assert(
      fc.property(scenes, ({ width, height, header, strings, faces, moves }) => {
        const picture = { width, height, top: 32 };
        const obstacles = [
          { left: 16, top: 14, right: width * 0.4, bottom: header },
          { left: 0, top: height - 80, right: width, bottom: height },
          ...faces.map(({ x, y, size }) => ({
            left: x * width - size / 2,
            top: y * height - size,
            right: x * width + size / 2,
            bottom: y * height + size,
          })),
        ];
        let placements: (LabelPlacement | null)[] = [];
        let [dx, dy, now] = [0, 0, 0];
        for (const [x, y, later] of [[0, 0, 0], ...moves]) {
          [dx, dy, now] = [dx + x, dy + y, now + later];
          const labels = strings.map(({ x, y, long, rank, held }, index) =>
            held || index % 2 === 0
              ? label(x * width + (index % 2 === 0 ? dx : -dx), y * height + dy, rank, [
                  { width: long + 60, height: 28 },
                  { width: long, height: 28 },
                  SIZES[INITIAL],
                ])
              : null,
          );
          placements = lay(labels, obstacles, placements, now, picture);
          expect(placements.map((one) => one !== null)).toEqual(labels.map((one) => one !== null));
          expect(misplacedBoxes(placements, labels, obstacles, picture)).toEqual([]);
        }
      }),
      { numRuns: 300 },
    );
  });

  test("sixteen at one place are all placed", () => {
    const crowd = Array.from({ length: 16 }, (_, index) => label(700 + index, 300, index % 3));
    expect(misplacedBoxes(lay(crowd), crowd, [], PICTURE)).toEqual([]);
  });

  test("all get an initial first, and own tags are the longest", () => {
    // phone width, bars side by side
    const picture = { width: 390, height: 844, top: 32 };
    const labels = Array.from({ length: 8 }, (_, index) =>
      label(30 + 47 * index, 200 - (index % 2) * 30, index === 5 ? 0 : 2),
    ).map((one) => ({ ...one, bar: { ...one.bar, left: one.bar.left + 20, right: one.bar.right - 20 } }));
    const sizes = sizesOf(lay(labels, [], [], 0, picture));
    expect(sizes).not.toContain(null);
    expect(sizes[5]).toBeLessThanOrEqual(NAME);
    expect(sizes.filter((size) => size === INITIAL).length).toBeGreaterThan(0);
  });

  test("without changes stay where they are", () => {
    const labels = Array.from({ length: 12 }, (_, index) =>
      label(100 + 90 * (index % 6), 200 + 60 * Math.floor(index / 6), index % 3),
    );
    let placements = lay(labels);
    for (let now = 16; now < 3_000; now += 16) {
      const next = lay(labels, [], placements, now);
      // tags that can be upgraded are upgraded once
      if (now > 1_000) expect(next.map((one) => one?.box)).toEqual(placements.map((one) => one?.box));
      placements = next;
    }
  });
});

describe("shortened tag", () => {
  const crowded = [label(700, 300), label(700, 340, 2, [SIZES[WHOLE], SIZES[NAME]])];
  const walls = (away: number) => [
    { left: 0, top: 0, right: 700 - away, bottom: 900 },
    { left: 700 + away, top: 0, right: 1440, bottom: 900 },
  ];

  test("stays short until spare space was free for a while", () => {
    const one = [label(700, 300)];
    const short = lay(one, walls(60));
    expect(sizesOf(short)).toEqual([NAME]);
    // space without the upgrade margin is not enough
    const little = lay(one, walls(75), short, 100);
    expect(sizesOf(little)).toEqual([NAME]);
    expect(little[0]?.upgradableSinceMs).toBe(null);
    const room = lay(one, walls(90), little, 200);
    expect(sizesOf(room)).toEqual([NAME]);
    expect(sizesOf(lay(one, walls(90), room, 900))).toEqual([NAME]);
    expect(sizesOf(lay(one, walls(90), room, 1_001))).toEqual([WHOLE]);
    // an interruption restarts the delay
    const gone = lay(one, walls(75), room, 900);
    expect(sizesOf(lay(one, walls(90), gone, 1_001))).toEqual([NAME]);
  });

  test("is shortened at once if an obstacle appears", () => {
    const one = [label(700, 300)];
    const whole = lay(one);
    expect(sizesOf(lay(one, walls(60), whole, 1))).toEqual([NAME]);
    expect(sizesOf(lay(one, walls(42), whole, 1))).toEqual([NAME]);
    expect(sizesOf(lay(one, walls(30), whole, 1))).toEqual([INITIAL]);
  });

  test("makes way for a tag of a lower rank", () => {
    const previous = lay(crowded);
    const now = [label(700, 310, 2), label(700, 340, 0, crowded[1].sizes as typeof SIZES)];
    const placements = lay(now, walls(80), previous, 16);
    expect(misplacedBoxes(placements, now, walls(80), PICTURE)).toEqual([]);
    expect(placements[1]?.size).toBeLessThanOrEqual(placements[0]?.box ? placements[0].size : INITIAL);
  });

  test("stays beside its bar until the space above was free for a while", () => {
    const above = { left: 600, top: 240, right: 800, bottom: 280 };
    const aside = lay([label(700, 300)], [above]);
    expect([aside[0]?.size, aside[0]?.place]).toEqual([WHOLE, 3]);
    const free = lay([label(700, 300)], [], aside, 100);
    expect(free[0]?.place).toBe(3);
    expect(lay([label(700, 300)], [], free, 1_000)[0]?.place).toBe(0);
  });
});

describe("invitation", () => {
  const size = { width: 110, height: 28 };
  const at = { x: 700, y: 400 };

  test("is to the right of a hand, and stays on its side", () => {
    expect(placeBeside(at, 26, size, [], PICTURE, 0)).toEqual({
      side: 0,
      box: { left: 726, right: 836, top: 386, bottom: 414 },
    });
    expect(placeBeside(at, 26, size, [], PICTURE, 1)?.box.right).toBe(674);
  });

  test("avoids obstacles, and is hidden without space", () => {
    const right = { left: 740, top: 300, right: 900, bottom: 500 };
    expect(placeBeside(at, 26, size, [right], PICTURE, 0)?.side).toBe(1);
    expect(placeBeside({ x: 1380, y: 400 }, 26, size, [], PICTURE, 0)?.side).toBe(1);
    expect(placeBeside(at, 26, size, [{ left: 0, top: 0, right: 1440, bottom: 900 }], PICTURE, 0)).toBe(null);
  });

  test("tries the given sides in their order", () => {
    expect(placeBeside(at, 26, size, [], PICTURE, null, [1, 2, 3, 0])?.side).toBe(1);
    expect(placeBeside({ x: 20, y: 400 }, 26, size, [], PICTURE, null, [1, 2, 3, 0])?.side).toBe(0);
    expect(placeBeside({ x: 80, y: 400 }, 26, size, [], PICTURE, null, [1, 2, 3, 0])?.side).toBe(2);
  });
});

test("a bar that is hidden behind an obstacle has no tag", () => {
  const panel = { left: 600, top: 200, right: 1000, bottom: 600 };
  expect(lay([label(700, 300)], [panel])[0]?.box).toBe(null);
  expect(lay([label(590, 300)], [panel])[0]?.box).not.toBe(null);
});
