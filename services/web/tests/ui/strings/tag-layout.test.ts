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
/** As it is written: whole, the name alone, its initial. */
const [WHOLE, NAME, INITIAL] = [0, 1, 2];

function bar(x: number, y: number): ScreenBox {
  return { left: x - 40, top: y - 10, right: x + 40, bottom: y + 10 };
}

function label(x: number, y: number, rank = 0, sizes = SIZES): TagLabel {
  return { bar: bar(x, y), sizes, rank };
}

const lay = (
  labels: readonly (TagLabel | null)[],
  keep: readonly ScreenBox[] = [],
  before: readonly (LabelPlacement | null)[] = [],
  now = 0,
  picture = PICTURE,
) => layOutLabels(labels, keep, before, picture, now);
const sizesOf = (laid: readonly (LabelPlacement | null)[]) => laid.map((one) => one && (one.box ? one.size : null));

/** What of these boxes is not in the picture, or covers another, a bar or what is kept. */
function wrong(
  laid: readonly (LabelPlacement | null)[],
  labels: readonly (TagLabel | null)[],
  keep: readonly ScreenBox[],
  { width, height, top }: LabelViewport,
): ScreenBox[] {
  const boxes = laid.flatMap((one) => one?.box ?? []);
  const bars = labels.flatMap((one) => one?.bar ?? []);
  return boxes.filter((box, nth) => {
    const within = box.left >= 0 && box.right <= width && box.top >= top && box.bottom <= height;
    return !within || [...keep, ...bars, ...boxes.filter((_, k) => k !== nth)].some((other) => overlaps(box, other));
  });
}

describe("names by their bars", () => {
  test("stand above them, in the middle, as a whole", () => {
    const [laid] = lay([label(700, 300)]);
    expect(laid).toEqual({ size: WHOLE, place: 0, since: null, box: { left: 630, right: 770, top: 252, bottom: 278 } });
  });

  test("are none where there is no bar, or that is out of the picture", () => {
    expect(lay([null, null])).toEqual([null, null]);
    expect(lay([label(-60, 300), label(700, 930)]).map((one) => one?.box)).toEqual([null, null]);
  });

  test("keep in the picture", () => {
    const [left, right] = lay([label(20, 300), label(1430, 300)]);
    expect(left?.box?.left).toBe(8);
    expect(right?.box?.right).toBe(PICTURE.width - 8);
  });

  test("go beside their bar where the header is above it", () => {
    const [laid] = lay([label(700, 80)]);
    expect(laid?.box?.top).toBeGreaterThanOrEqual(PICTURE.top);
    expect(overlaps(laid!.box!, bar(700, 80))).toBe(false);
  });

  test("are not at all where there is no room even for the shortest", () => {
    const everywhere = { left: 0, top: 0, right: PICTURE.width, bottom: PICTURE.height };
    expect(lay([label(700, 300)], [everywhere])[0]?.box).toBe(null);
  });

  test("of four on a wide stage are whole, as each makes room for the others", () => {
    expect(sizesOf(lay([label(620, 200), label(730, 200), label(840, 200), label(700, 240)]))).toEqual([
      WHOLE,
      WHOLE,
      WHOLE,
      WHOLE,
    ]);
  });
});

describe("names of many", () => {
  /** A window, what stands before it, and as many as sixteen bars, of names long and short, in three ranks, that have moved on from frame to frame. */
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

  test("cover neither one another nor a bar, a face or what else is kept, and are within the window: wherever bars hang, and go on to", () => {
    fc.assert(
      fc.property(scenes, ({ width, height, header, strings, faces, moves }) => {
        const picture = { width, height, top: 32 };
        const keep = [
          { left: 16, top: 14, right: width * 0.4, bottom: header },
          { left: 0, top: height - 80, right: width, bottom: height },
          ...faces.map(({ x, y, size }) => ({
            left: x * width - size / 2,
            top: y * height - size,
            right: x * width + size / 2,
            bottom: y * height + size,
          })),
        ];
        let laid: (LabelPlacement | null)[] = [];
        let [dx, dy, now] = [0, 0, 0];
        for (const [x, y, later] of [[0, 0, 0], ...moves]) {
          [dx, dy, now] = [dx + x, dy + y, now + later];
          const labels = strings.map(({ x, y, long, rank, held }, nth) =>
            held || nth % 2 === 0
              ? label(x * width + (nth % 2 === 0 ? dx : -dx), y * height + dy, rank, [
                  { width: long + 60, height: 28 },
                  { width: long, height: 28 },
                  SIZES[INITIAL],
                ])
              : null,
          );
          laid = lay(labels, keep, laid, now, picture);
          expect(laid.map((one) => one !== null)).toEqual(labels.map((one) => one !== null));
          expect(wrong(laid, labels, keep, picture)).toEqual([]);
        }
      }),
      { numRuns: 300 },
    );
  });

  test("are laid well within a frame", () => {
    const crowd = Array.from({ length: 16 }, (_, nth) => label(700 + nth, 300, nth % 3));
    const began = performance.now();
    expect(wrong(lay(crowd), crowd, [], PICTURE)).toEqual([]);
    expect(performance.now() - began).toBeLessThan(500);
  });

  test("all have their initial before another is longer, and one's own are the longest", () => {
    // as wide as a phone, bars side by side
    const picture = { width: 390, height: 844, top: 32 };
    const labels = Array.from({ length: 8 }, (_, nth) =>
      label(30 + 47 * nth, 200 - (nth % 2) * 30, nth === 5 ? 0 : 2),
    ).map((one) => ({ ...one, bar: { ...one.bar, left: one.bar.left + 20, right: one.bar.right - 20 } }));
    const sizes = sizesOf(lay(labels, [], [], 0, picture));
    expect(sizes).not.toContain(null);
    expect(sizes[5]).toBeLessThanOrEqual(NAME);
    expect(sizes.filter((size) => size === INITIAL).length).toBeGreaterThan(0);
  });

  test("that stand together without change stay as they are from frame to frame", () => {
    const labels = Array.from({ length: 12 }, (_, nth) =>
      label(100 + 90 * (nth % 6), 200 + 60 * Math.floor(nth / 6), nth % 3),
    );
    let laid = lay(labels);
    for (let now = 16; now < 3_000; now += 16) {
      const next = lay(labels, [], laid, now);
      // what can stand better does so once
      if (now > 1_000) expect(next.map((one) => one?.box)).toEqual(laid.map((one) => one?.box));
      laid = next;
    }
  });
});

describe("a name that was shortened", () => {
  const crowded = [label(700, 300), label(700, 340, 2, [SIZES[WHOLE], SIZES[NAME]])];
  const walls = (away: number) => [
    { left: 0, top: 0, right: 700 - away, bottom: 900 },
    { left: 700 + away, top: 0, right: 1440, bottom: 900 },
  ];

  test("stays short until there was room to spare for a while", () => {
    const one = [label(700, 300)];
    const short = lay(one, walls(60));
    expect(sizesOf(short)).toEqual([NAME]);
    // just enough room is not enough
    const little = lay(one, walls(75), short, 100);
    expect(sizesOf(little)).toEqual([NAME]);
    expect(little[0]?.upgradableSinceMs).toBe(null);
    const room = lay(one, walls(90), little, 200);
    expect(sizesOf(room)).toEqual([NAME]);
    expect(sizesOf(lay(one, walls(90), room, 900))).toEqual([NAME]);
    expect(sizesOf(lay(one, walls(90), room, 1_001))).toEqual([WHOLE]);
    // gone in between, it counts from anew
    const gone = lay(one, walls(75), room, 900);
    expect(sizesOf(lay(one, walls(90), gone, 1_001))).toEqual([NAME]);
  });

  test("is shortened at once where something comes in the way", () => {
    const one = [label(700, 300)];
    const whole = lay(one);
    expect(sizesOf(lay(one, walls(60), whole, 1))).toEqual([NAME]);
    expect(sizesOf(lay(one, walls(42), whole, 1))).toEqual([NAME]);
    expect(sizesOf(lay(one, walls(30), whole, 1))).toEqual([INITIAL]);
  });

  test("makes room for one of a lower rank, which keeps its own", () => {
    const before = lay(crowded);
    const now = [label(700, 310, 2), label(700, 340, 0, crowded[1].sizes as typeof SIZES)];
    const laid = lay(now, walls(80), before, 16);
    expect(wrong(laid, now, walls(80), PICTURE)).toEqual([]);
    expect(laid[1]?.size).toBeLessThanOrEqual(laid[0]?.box ? laid[0].size : INITIAL);
  });

  test("stays beside its bar, where it went, until there was room above for a while", () => {
    const above = { left: 600, top: 240, right: 800, bottom: 280 };
    const aside = lay([label(700, 300)], [above]);
    expect([aside[0]?.size, aside[0]?.place]).toEqual([WHOLE, 3]);
    const free = lay([label(700, 300)], [], aside, 100);
    expect(free[0]?.place).toBe(3);
    expect(lay([label(700, 300)], [], free, 1_000)[0]?.place).toBe(0);
  });
});

describe("the invitation", () => {
  const size = { width: 110, height: 28 };
  const at = { x: 700, y: 400 };

  test("stands to the right of a hand, and stays on the side where it was", () => {
    expect(placeBeside(at, 26, size, [], PICTURE, 0)).toEqual({
      side: 0,
      box: { left: 726, right: 836, top: 386, bottom: 414 },
    });
    expect(placeBeside(at, 26, size, [], PICTURE, 1)?.box.right).toBe(674);
  });

  test("goes where it covers nothing, and is not where it would", () => {
    const right = { left: 740, top: 300, right: 900, bottom: 500 };
    expect(placeBeside(at, 26, size, [right], PICTURE, 0)?.side).toBe(1);
    expect(placeBeside({ x: 1380, y: 400 }, 26, size, [], PICTURE, 0)?.side).toBe(1);
    expect(placeBeside(at, 26, size, [{ left: 0, top: 0, right: 1440, bottom: 900 }], PICTURE, 0)).toBe(null);
  });
});
