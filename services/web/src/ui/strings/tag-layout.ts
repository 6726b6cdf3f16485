/** Where names stand: by their bars, and never over another name, a bar or what else is to be seen. Where there is little room they are shorter. Pure; CSS pixels, y down. */
import { overlaps, type ScreenBox } from "../../stage/camera/screen-box";

export interface Size {
  width: number;
  height: number;
}

/** A name, and the bar that it belongs to. */
export interface TagLabel {
  bar: ScreenBox;
  /** As it may be written, from the whole to the shortest. */
  sizes: readonly Size[];
  /** Names of a lower rank have the first choice. */
  rank: number;
}

/** Where names may stand: below `top`, and within. */
export interface LabelViewport extends Size {
  top: number;
}

/** How a name stands: told again for the next frame it stays so as long as it can. */
export interface LabelPlacement {
  /** Null where there is no room even for the shortest. */
  box: ScreenBox | null;
  /** Which of its sizes it is written in, and which of the places by its bar it has. */
  size: number;
  place: number;
  /** Since when it could stand better; null while it cannot. Milliseconds. */
  upgradableSinceMs: number | null;
}

/** From a bar to its name, and to one that is written shortest. */
const TAG_GAP_PX = 12;
const SHORTEST_TAG_GAP_PX = 4;
/** From a name to what is beside it, as it comes there. */
const OBSTACLE_MARGIN_PX = 4;
/** A name stands better again only where there is so much more room, and has been for so long, milliseconds. */
const UPGRADE_MARGIN_PX = 10;
const UPGRADE_DELAY_MS = 800;
/** From the picture's sides. */
const VIEWPORT_MARGIN_PX = 8;
/** The size that all have before any is written in the first. */
const FIRST_PASS_SIZE = 1;

interface CandidatePosition {
  box: ScreenBox;
  size: number;
  place: number;
}

/**
 * How `labels` stand at `now`, milliseconds, null for null. `keep` are boxes that nothing may cover beside the bars, `before` what this told of the frame before. A new name
 * is as long as there is room for; later, one makes room for those of a lower rank at once, and is longer again only after a while. All keep the shortest before
 * one has more.
 */
export function layOutLabels(
  labels: readonly (TagLabel | null)[],
  obstacles: readonly ScreenBox[],
  previous: readonly (LabelPlacement | null)[],
  viewport: LabelViewport,
  now: number,
): (LabelPlacement | null)[] {
  const there = labels.flatMap((label, nth) =>
    label ? { nth, label, last: previous[nth] ?? null, spots: candidatePositions(label, viewport) } : [],
  );
  there.sort((a, b) => a.label.rank - b.label.rank);
  const fixed = [...obstacles, ...there.map(({ label }) => label.bar)];
  const laid = labels.map((): LabelPlacement | null => null);
  const stood = there.map(({ nth, label, last, spots }, turn) => {
    const taken = [...fixed, ...there.slice(0, turn).flatMap((one) => laid[one.nth]?.box ?? [])];
    const least = there.slice(turn + 1).flatMap((one) => reservedBoxes(one.spots, one.label, one.last));
    const standing = placeLabel(spots, label, last, taken, least);
    laid[nth] = upgradePlacement(
      standing,
      standing.upgradableSinceMs,
      spots,
      last,
      [...taken, ...least],
      Math.min(FIRST_PASS_SIZE, standing.size),
      now,
    );
    return standing;
  });
  there.forEach(({ nth, last, spots }, turn) => {
    const standing = laid[nth] as LabelPlacement;
    if (standing.upgradableSinceMs !== null || standing.size === 0) return;
    const taken = [...fixed, ...there.flatMap((one) => (one.nth === nth ? [] : (laid[one.nth]?.box ?? [])))];
    laid[nth] = upgradePlacement(standing, stood[turn].upgradableSinceMs, spots, last, taken, 0, now);
  });
  return laid;
}

/** The box of a thing of this size beside a place, `away` from it and free of `taken`: at the `side` where it was, else right, left, above or below. Null where it has no room. */
export function placeBeside(
  { x, y }: { x: number; y: number },
  distance: number,
  { width, height }: Size,
  obstacles: readonly ScreenBox[],
  viewport: LabelViewport,
  previousSide: number,
): { box: ScreenBox; side: number } | null {
  const corners = [
    [x + distance, y - height / 2],
    [x - distance - width, y - height / 2],
    [x - width / 2, y - distance - height],
    [x - width / 2, y + distance],
  ] as const;
  const sides = corners.map(([left, top], nth) => ({
    side: nth,
    box: { left, top, right: left + width, bottom: top + height },
  }));
  const free = sides.filter(({ box }) => isInsideViewport(box, viewport) && isFree(box, obstacles));
  return free.find((one) => one.side === previousSide) ?? free[0] ?? null;
}

/** As it stood, else as long elsewhere, else shorter; a new one at its shortest. Free of what others need at `least`, where that can be. */
function placeLabel(
  candidates: readonly CandidatePosition[],
  { sizes }: TagLabel,
  previous: LabelPlacement | null,
  obstacles: readonly ScreenBox[],
  reserved: readonly ScreenBox[],
): LabelPlacement {
  const gone: LabelPlacement = {
    box: null,
    size: sizes.length - 1,
    place: 0,
    upgradableSinceMs: previous?.upgradableSinceMs ?? null,
  };
  if (previous && !previous.box) return gone;
  const same = previous && candidates.find(({ size, place }) => size === previous.size && place === previous.place);
  if (previous && same && isFree(same.box, obstacles))
    return { ...same, upgradableSinceMs: previous.upgradableSinceMs };
  const others = candidates.filter(({ size }) => size >= (previous ? previous.size : sizes.length - 1));
  const found =
    others.find(({ box }) => isFree(box, [...obstacles, ...reserved], OBSTACLE_MARGIN_PX)) ??
    others.find(({ box }) => isFree(box, obstacles));
  return { ...gone, ...found, upgradableSinceMs: null };
}

/** The first spot before the one it has, and not longer than the size `most`, once there has been room since `since` for long enough: for a new one at once. */
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
  const found = candidates.find((spot) => {
    const before = !box || spot.size < size || (spot.size === size && spot.place < place);
    return (
      before &&
      spot.size >= largestSize &&
      isFree(spot.box, obstacles, previous ? UPGRADE_MARGIN_PX : OBSTACLE_MARGIN_PX)
    );
  });
  if (!found) return { ...current, upgradableSinceMs: null };
  const from = since ?? now;
  return previous && now - from < UPGRADE_DELAY_MS
    ? { ...current, upgradableSinceMs: from }
    : { ...found, upgradableSinceMs: null };
}

/** What a name needs at least: its shortest, where it stands. */
function reservedBoxes(
  candidates: readonly CandidatePosition[],
  { sizes }: TagLabel,
  previous: LabelPlacement | null,
): ScreenBox[] {
  const place = previous?.place ?? 0;
  return candidates.flatMap((spot) => (spot.size === sizes.length - 1 && spot.place === place ? spot.box : []));
}

/** The places for each of its sizes that are within the picture, the best first. */
function candidatePositions({ bar, sizes }: TagLabel, viewport: LabelViewport): CandidatePosition[] {
  const seen = bar.right > 0 && bar.left < viewport.width && bar.bottom > 0 && bar.top < viewport.height;
  if (!seen) return [];
  return sizes.flatMap((written, size) => {
    const gap = size > 0 && size === sizes.length - 1 ? SHORTEST_TAG_GAP_PX : TAG_GAP_PX;
    const spots = anchorBoxes(bar, written, gap, viewport.width).map((box, place) => ({ box, size, place }));
    return spots.filter(({ box }) => isInsideViewport(box, viewport));
  });
}

/** Above the bar, above it to either side, beside it, and once more above all that. */
function anchorBoxes(bar: ScreenBox, { width, height }: Size, gap: number, viewportWidth: number): ScreenBox[] {
  const middle = (bar.left + bar.right - width) / 2;
  const above = bar.top - gap - height;
  const level = (bar.top + bar.bottom - height) / 2;
  const higher = above - height - gap / 2;
  const places = [
    [middle, above],
    [bar.right - width, above],
    [bar.left, above],
    [bar.left - gap - width, level],
    [bar.right + gap, level],
    [middle, higher],
    [bar.right - width, higher],
    [bar.left, higher],
  ] as const;
  return places.map(([x, y]) => {
    const left = Math.max(VIEWPORT_MARGIN_PX, Math.min(viewportWidth - VIEWPORT_MARGIN_PX - width, x));
    return { left, top: y, right: left + width, bottom: y + height };
  });
}

function isInsideViewport(box: ScreenBox, { width, height, top }: LabelViewport): boolean {
  return (
    box.left >= VIEWPORT_MARGIN_PX && box.right <= width - VIEWPORT_MARGIN_PX && box.top >= top && box.bottom <= height
  );
}

/** Whether a box, and as much about it as `margin`, covers none of these. */
function isFree(box: ScreenBox, obstacles: readonly ScreenBox[], margin = 0): boolean {
  return !obstacles.some((other) => overlaps(box, other, margin));
}
