/**
 * Layout of name tags: each stands beside the bar of its string and covers no other tag, bar or obstacle. Tags get
 * shorter where space is scarce. Pure; CSS pixels, y down.
 */
import { overlaps, type ScreenBox } from "../../stage/camera/screen-box";

export interface Size {
  width: number;
  height: number;
}

/** Tag to be placed beside a bar. */
export interface TagLabel {
  bar: ScreenBox;
  /** Sizes of its forms, from the longest to the shortest. */
  sizes: readonly Size[];
  /** Tags of a lower rank are placed first. */
  rank: number;
}

/** Area for tags: the picture below `top`. */
export interface LabelViewport extends Size {
  top: number;
}

/**
 * Placement of a tag. Passed to the layout of the next frame, so that tags stay where they are for as long as
 * possible.
 */
export interface LabelPlacement {
  /** Null if there is no space even for the shortest form. */
  box: ScreenBox | null;
  /** Index of its form, and of its position beside the bar. */
  size: number;
  place: number;
  /** Time in milliseconds since which a better placement is possible; null if none is. */
  upgradableSinceMs: number | null;
}

/** Distance between a bar and its tag, and its tag in the shortest form. */
const TAG_GAP_PX = 12;
const SHORTEST_TAG_GAP_PX = 4;
/** Distance that a tag keeps from obstacles when it is placed. */
const OBSTACLE_MARGIN_PX = 4;
/** A tag is upgraded only if this much space around the better placement has been free for this long. */
const UPGRADE_MARGIN_PX = 10;
const UPGRADE_DELAY_MS = 800;
/** Distance from the left and right edges of the picture. */
const VIEWPORT_MARGIN_PX = 8;
/** Form that all tags get before any tag gets the longest one. */
const FIRST_PASS_SIZE = 1;

interface CandidatePosition {
  box: ScreenBox;
  size: number;
  place: number;
}

/**
 * Place `labels` at time `now` in milliseconds; the result is null where the label is null. Tags cover neither bars
 * nor `obstacles`. `previous` is the result of the last frame. A new tag gets the longest form that fits. Later it
 * makes way for tags of a lower rank at once, and gets longer again only after a delay. Every tag gets its shortest
 * form before any gets a longer one.
 */
export function layOutLabels(
  labels: readonly (TagLabel | null)[],
  obstacles: readonly ScreenBox[],
  previous: readonly (LabelPlacement | null)[],
  viewport: LabelViewport,
  now: number,
): (LabelPlacement | null)[] {
  const entries = labels.flatMap((label, index) =>
    label
      ? { index, label, last: previous[index] ?? null, candidates: candidatePositions(label, obstacles, viewport) }
      : [],
  );
  entries.sort((a, b) => a.label.rank - b.label.rank);
  const fixed = [...obstacles, ...entries.map(({ label }) => label.bar)];
  const placements = labels.map((): LabelPlacement | null => null);
  // First pass, by rank: up to the form FIRST_PASS_SIZE, leaving space for the shortest form of the following tags.
  const firstPass = entries.map(({ index, label, last, candidates }, order) => {
    const taken = [...fixed, ...entries.slice(0, order).flatMap((entry) => placements[entry.index]?.box ?? [])];
    const reserved = entries
      .slice(order + 1)
      .flatMap((entry) => reservedBoxes(entry.candidates, entry.label, entry.last));
    const placement = placeLabel(candidates, label, last, taken, reserved);
    placements[index] = upgradePlacement(
      placement,
      placement.upgradableSinceMs,
      candidates,
      last,
      [...taken, ...reserved],
      Math.min(FIRST_PASS_SIZE, placement.size),
      now,
    );
    return placement;
  });
  // Second pass: the longest form where space is left.
  entries.forEach(({ index, last, candidates }, order) => {
    const placement = placements[index] as LabelPlacement;
    if (placement.upgradableSinceMs !== null || placement.size === 0) return;
    const others = entries.filter((entry) => entry.index !== index);
    const taken = [...fixed, ...others.flatMap((entry) => placements[entry.index]?.box ?? [])];
    const since = firstPass[order].upgradableSinceMs;
    placements[index] = upgradePlacement(placement, since, candidates, last, taken, 0, now);
  });
  return placements;
}

/** Side of a point: right, left, above or below it. */
export type Side = 0 | 1 | 2 | 3;

/**
 * Return a box of the given size at a `distance` from a point, clear of `obstacles`: on `previousSide` if possible,
 * else on the first of `sides` with space. Returns null if none has.
 */
export function placeBeside(
  { x, y }: { x: number; y: number },
  distance: number,
  { width, height }: Size,
  obstacles: readonly ScreenBox[],
  viewport: LabelViewport,
  previousSide: Side | null,
  sides: readonly Side[] = [0, 1, 2, 3],
): { box: ScreenBox; side: Side } | null {
  const corners = [
    [x + distance, y - height / 2],
    [x - distance - width, y - height / 2],
    [x - width / 2, y - distance - height],
    [x - width / 2, y + distance],
  ] as const;
  const candidates = sides.map((side) => {
    const [left, top] = corners[side];
    return { side, box: { left, top, right: left + width, bottom: top + height } };
  });
  const free = candidates.filter(({ box }) => isInsideViewport(box, viewport) && isFree(box, obstacles));
  return free.find(({ side }) => side === previousSide) ?? free[0] ?? null;
}

/**
 * Place a tag as in the previous frame, else in the same form elsewhere, else in a shorter form. A new tag gets its
 * shortest form. Boxes that are `reserved` for other tags are avoided if possible.
 */
function placeLabel(
  candidates: readonly CandidatePosition[],
  { sizes }: TagLabel,
  previous: LabelPlacement | null,
  obstacles: readonly ScreenBox[],
  reserved: readonly ScreenBox[],
): LabelPlacement {
  const hidden: LabelPlacement = {
    box: null,
    size: sizes.length - 1,
    place: 0,
    upgradableSinceMs: previous?.upgradableSinceMs ?? null,
  };
  if (previous && !previous.box) return hidden;
  const same = previous && candidates.find(({ size, place }) => size === previous.size && place === previous.place);
  if (previous && same && isFree(same.box, obstacles))
    return { ...same, upgradableSinceMs: previous.upgradableSinceMs };
  const others = candidates.filter(({ size }) => size >= (previous ? previous.size : sizes.length - 1));
  const found =
    others.find(({ box }) => isFree(box, [...obstacles, ...reserved], OBSTACLE_MARGIN_PX)) ??
    others.find(({ box }) => isFree(box, obstacles));
  return { ...hidden, ...found, upgradableSinceMs: null };
}

/**
 * Move a tag to the first better candidate that is not longer than the form `largestSize`, once it has been possible
 * since `since` for UPGRADE_DELAY_MS. A new tag is upgraded at once.
 */
function upgradePlacement(
  current: LabelPlacement,
  since: number | null,
  candidates: readonly CandidatePosition[],
  previous: LabelPlacement | null,
  obstacles: readonly ScreenBox[],
  largestSize: number,
  now: number,
): LabelPlacement {
  const { box, size, place } = current;
  const found = candidates.find((candidate) => {
    const isBetter = !box || candidate.size < size || (candidate.size === size && candidate.place < place);
    return (
      isBetter &&
      candidate.size >= largestSize &&
      isFree(candidate.box, obstacles, previous ? UPGRADE_MARGIN_PX : OBSTACLE_MARGIN_PX)
    );
  });
  if (!found) return { ...current, upgradableSinceMs: null };
  const from = since ?? now;
  return previous && now - from < UPGRADE_DELAY_MS
    ? { ...current, upgradableSinceMs: from }
    : { ...found, upgradableSinceMs: null };
}

/** Return the box that a tag needs at least: its shortest form at its position. */
function reservedBoxes(
  candidates: readonly CandidatePosition[],
  { sizes }: TagLabel,
  previous: LabelPlacement | null,
): ScreenBox[] {
  const place = previous?.place ?? 0;
  return candidates.flatMap((candidate) =>
    candidate.size === sizes.length - 1 && candidate.place === place ? candidate.box : [],
  );
}

/** Return the positions of all forms that are inside the picture, the best first. There are none for a hidden bar. */
function candidatePositions(
  { bar, sizes }: TagLabel,
  obstacles: readonly ScreenBox[],
  viewport: LabelViewport,
): CandidatePosition[] {
  const isInPicture = bar.right > 0 && bar.left < viewport.width && bar.bottom > 0 && bar.top < viewport.height;
  if (!isInPicture || obstacles.some((obstacle) => contains(obstacle, bar))) return [];
  return sizes.flatMap((formSize, size) => {
    const gap = size > 0 && size === sizes.length - 1 ? SHORTEST_TAG_GAP_PX : TAG_GAP_PX;
    const candidates = anchorBoxes(bar, formSize, gap, viewport.width).map((box, place) => ({ box, size, place }));
    return candidates.filter(({ box }) => isInsideViewport(box, viewport));
  });
}

/** Return boxes above the bar, above it to either side, beside it, and one row higher. */
function anchorBoxes(bar: ScreenBox, { width, height }: Size, gap: number, viewportWidth: number): ScreenBox[] {
  const middle = (bar.left + bar.right - width) / 2;
  const above = bar.top - gap - height;
  const level = (bar.top + bar.bottom - height) / 2;
  const higher = above - height - gap / 2;
  const corners = [
    [middle, above],
    [bar.right - width, above],
    [bar.left, above],
    [bar.left - gap - width, level],
    [bar.right + gap, level],
    [middle, higher],
    [bar.right - width, higher],
    [bar.left, higher],
  ] as const;
  return corners.map(([x, y]) => {
    const left = Math.max(VIEWPORT_MARGIN_PX, Math.min(viewportWidth - VIEWPORT_MARGIN_PX - width, x));
    return { left, top: y, right: left + width, bottom: y + height };
  });
}

function contains(outer: ScreenBox, inner: ScreenBox): boolean {
  return (
    outer.left <= inner.left && outer.right >= inner.right && outer.top <= inner.top && outer.bottom >= inner.bottom
  );
}

function isInsideViewport(box: ScreenBox, { width, height, top }: LabelViewport): boolean {
  return (
    box.left >= VIEWPORT_MARGIN_PX && box.right <= width - VIEWPORT_MARGIN_PX && box.top >= top && box.bottom <= height
  );
}

/** Return whether a box keeps at least `margin` from all obstacles. */
function isFree(box: ScreenBox, obstacles: readonly ScreenBox[], margin = 0): boolean {
  return !obstacles.some((other) => overlaps(box, other, margin));
}
