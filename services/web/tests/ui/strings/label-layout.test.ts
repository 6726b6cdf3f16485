import { expect, test } from "vitest";
import type { ScreenBox } from "../../../src/stage/camera/screen-box";
import { overlaps } from "../../../src/stage/camera/screen-box";
import type { LimbState } from "../../../src/ui/limb-state";
import { type LabelAnchors, LabelLayout, type LabelMetrics, NO_LABELS } from "../../../src/ui/strings/label-layout";

const SIZES = [
  { width: 140, height: 26 },
  { width: 70, height: 26 },
  { width: 22, height: 22 },
];
const METRICS: LabelMetrics = {
  tags: [SIZES, SIZES, null, null],
  invitation: null,
  viewport: { width: 1440, height: 900, top: 60 },
  obstacles: [],
};
const INVITED = { ...METRICS, invitation: { width: 100, height: 28 } };
const HAND = { x: 700, y: 400 };

function limb(mine: boolean | null): LimbState {
  const holder = mine === null ? null : { id: "a", name: "Aiko", colour: 0, mine };
  return { holder, requesters: [], requestedByMe: false, selected: false };
}

function bar(x: number, y: number): ScreenBox {
  return { left: x - 40, top: y - 10, right: x + 40, bottom: y + 10 };
}

function anchors(changes: Partial<LabelAnchors> = {}): LabelAnchors {
  return {
    limbs: [limb(true), limb(null), limb(null), limb(null)],
    bars: [bar(700, 300), null, null, null],
    faces: [],
    hand: null,
    ...changes,
  };
}

function createLayout(metrics = METRICS): LabelLayout {
  const layout = new LabelLayout();
  layout.metrics = metrics;
  return layout;
}

test("a tag stands above its bar, rounded to a tenth of a pixel", () => {
  const { tags, invitation } = createLayout().update(anchors({ bars: [bar(700.123, 300)] }), 0, 0);
  expect(tags).toEqual([{ form: 0, left: 630.1, top: 252 }, null, null, null]);
  expect(invitation).toBe(null);
});

test("a limb without a holder, a bar or a measured tag has no position", () => {
  const layout = createLayout();
  expect(layout.update(anchors({ limbs: [limb(null)] }), 0, 0).tags).toEqual([null]);
  expect(layout.update(anchors({ bars: [] }), 0, 0).tags[0]).toBe(null);
  layout.metrics = NO_LABELS;
  expect(layout.update(anchors(), 0, 0).tags[0]).toBe(null);
});

test("a tag covers neither faces nor other parts of the page", () => {
  const above = { left: 600, top: 220, right: 800, bottom: 285 };
  for (const [metrics, faces] of [
    [METRICS, [above]],
    [{ ...METRICS, obstacles: [above] }, []],
  ] as const) {
    const [tag] = createLayout(metrics).update(anchors({ faces }), 0, 0).tags;
    const { width, height } = SIZES[tag!.form];
    const box = { left: tag!.left, top: tag!.top, right: tag!.left + width, bottom: tag!.top + height };
    expect(overlaps(box, above)).toBe(false);
  }
});

test("tags of this page's user are placed before others, then those of the selected performer", () => {
  const tags = Array.from({ length: 8 }, () => SIZES);
  const viewport = { width: 160, height: 130, top: 60 };
  // Limbs 0 and 4 are at the same place, and only one tag gets the best position.
  const bars = Array.from({ length: 8 }, (_, at) => (at === 0 || at === 4 ? bar(80, 110) : null));
  const findFirst = (mine: readonly number[], selected: number) => {
    const limbs = bars.map((box, at) => limb(box && mine.includes(at)));
    const positions = createLayout({ ...METRICS, tags, viewport }).update(anchors({ limbs, bars }), selected, 0);
    return positions.tags.findIndex((tag) => tag?.left === 98);
  };
  expect(findFirst([0], 1)).toBe(0);
  expect(findFirst([4], 0)).toBe(4);
  expect(findFirst([], 0)).toBe(0);
  expect(findFirst([], 1)).toBe(4);
});

test("a viewport of another size places all tags anew", () => {
  const layout = createLayout({ ...METRICS, viewport: { ...METRICS.viewport, width: 760 } });
  const [narrow] = layout.update(anchors(), 0, 0).tags;
  expect(narrow?.left).toBe(612);
  layout.metrics = METRICS;
  expect(layout.update(anchors(), 0, 10).tags[0]?.left).toBe(630);
});

test("the invitation stands beside the hand, away from the performer", () => {
  const face = { left: 780, top: 200, right: 820, bottom: 260 };
  const { invitation } = createLayout(INVITED).update(anchors({ hand: HAND, faces: [face] }), 0, 0);
  expect(invitation).toEqual({ form: 0, left: 574, top: 386 });
  const mirrored = { ...face, left: 580, right: 620 };
  expect(createLayout(INVITED).update(anchors({ hand: HAND, faces: [mirrored] }), 0, 0).invitation?.left).toBe(726);
});

test("the invitation keeps its side, and is hidden without a hand or without space", () => {
  const layout = createLayout(INVITED);
  const before = layout.update(anchors({ hand: HAND }), 0, 0).invitation;
  const face = { left: 780, top: 200, right: 820, bottom: 260 };
  expect(layout.update(anchors({ hand: HAND, faces: [face] }), 0, 0).invitation).toEqual(before);
  expect(layout.update(anchors(), 0, 0).invitation).toBe(null);
  const everywhere = { left: 0, top: 0, right: 1440, bottom: 900 };
  layout.metrics = { ...INVITED, obstacles: [everywhere] };
  expect(layout.update(anchors({ hand: HAND }), 0, 0).invitation).toBe(null);
});
