/** Where names stand: by their bars, and never over another name, a bar or what else is to be seen. Where there is little room they are shorter. Pure; CSS pixels, y down. */
import { overlaps, type Box } from "../stage/boxes";

export interface Size {
  width: number;
  height: number;
}

/** A name, and the bar that it belongs to. */
export interface Label {
  bar: Box;
  /** As it may be written, from the whole to the shortest. */
  sizes: readonly Size[];
  /** Names of a lower rank have the first choice. */
  rank: number;
}

/** Where names may stand: below `top`, and within. */
export interface Picture extends Size {
  top: number;
}

/** How a name stands: told again for the next frame it stays so as long as it can. */
export interface Laid {
  /** Null where there is no room even for the shortest. */
  box: Box | null;
  /** Which of its sizes it is written in, and which of the places by its bar it has. */
  size: number;
  place: number;
  /** Since when it could stand better; null while it cannot. Milliseconds. */
  since: number | null;
}

/** From a bar to its name, and to one that is written shortest. */
const GAP = 12;
const SHORT_GAP = 4;
/** From a name to what is beside it, as it comes there. */
const APART = 4;
/** A name stands better again only where there is so much more room, and has been for so long, milliseconds. */
const MORE = 10;
const LASTING = 800;
/** From the picture's sides. */
const SIDE = 8;
/** The size that all have before any is written in the first. */
const SHORTER = 1;

interface Spot {
  box: Box;
  size: number;
  place: number;
}

/**
 * How `labels` stand at `now`, milliseconds, null for null. `keep` are boxes that nothing may cover beside the bars, `before` what this told of the frame before. A new name
 * is as long as there is room for; later, one makes room for those of a lower rank at once, and is longer again only after a while. All keep the shortest before
 * one has more.
 */
export function layLabels(labels: readonly (Label | null)[], keep: readonly Box[], before: readonly (Laid | null)[], picture: Picture, now: number): (Laid | null)[] {
  const there = labels.flatMap((label, nth) => (label ? { nth, label, last: before[nth] ?? null, spots: spotsOf(label, picture) } : []));
  there.sort((a, b) => a.label.rank - b.label.rank);
  const fixed = [...keep, ...there.map(({ label }) => label.bar)];
  const laid = labels.map((): Laid | null => null);
  const stood = there.map(({ nth, label, last, spots }, turn) => {
    const taken = [...fixed, ...there.slice(0, turn).flatMap((one) => laid[one.nth]?.box ?? [])];
    const least = there.slice(turn + 1).flatMap((one) => leastOf(one.spots, one.label, one.last));
    const standing = settle(spots, label, last, taken, least);
    laid[nth] = better(standing, standing.since, spots, last, [...taken, ...least], Math.min(SHORTER, standing.size), now);
    return standing;
  });
  there.forEach(({ nth, last, spots }, turn) => {
    const standing = laid[nth] as Laid;
    if (standing.since !== null || standing.size === 0) return;
    const taken = [...fixed, ...there.flatMap((one) => (one.nth === nth ? [] : (laid[one.nth]?.box ?? [])))];
    laid[nth] = better(standing, stood[turn].since, spots, last, taken, 0, now);
  });
  return laid;
}

/** The box of a thing of this size beside a place, `away` from it and free of `taken`: at the `side` where it was, else right, left, above or below. Null where it has no room. */
export function layBeside({ x, y }: { x: number; y: number }, away: number, { width, height }: Size, taken: readonly Box[], picture: Picture, side: number): { box: Box; side: number } | null {
  const corners = [[x + away, y - height / 2], [x - away - width, y - height / 2], [x - width / 2, y - away - height], [x - width / 2, y + away]] as const;
  const sides = corners.map(([left, top], nth) => ({ side: nth, box: { left, top, right: left + width, bottom: top + height } }));
  const free = sides.filter(({ box }) => within(box, picture) && isFree(box, taken));
  return free.find((one) => one.side === side) ?? free[0] ?? null;
}

/** As it stood, else as long elsewhere, else shorter; a new one at its shortest. Free of what others need at `least`, where that can be. */
function settle(spots: readonly Spot[], { sizes }: Label, last: Laid | null, taken: readonly Box[], least: readonly Box[]): Laid {
  const gone: Laid = { box: null, size: sizes.length - 1, place: 0, since: last?.since ?? null };
  if (last && !last.box) return gone;
  const same = last && spots.find(({ size, place }) => size === last.size && place === last.place);
  if (last && same && isFree(same.box, taken)) return { ...same, since: last.since };
  const others = spots.filter(({ size }) => size >= (last ? last.size : sizes.length - 1));
  const found = others.find(({ box }) => isFree(box, [...taken, ...least], APART)) ?? others.find(({ box }) => isFree(box, taken));
  return { ...gone, ...found, since: null };
}

/** The first spot before the one it has, and not longer than the size `most`, once there has been room since `since` for long enough: for a new one at once. */
function better(standing: Laid, since: number | null, spots: readonly Spot[], last: Laid | null, taken: readonly Box[], most: number, now: number): Laid {
  const { box, size, place } = standing;
  const found = spots.find((spot) => {
    const before = !box || spot.size < size || (spot.size === size && spot.place < place);
    return before && spot.size >= most && isFree(spot.box, taken, last ? MORE : APART);
  });
  if (!found) return { ...standing, since: null };
  const from = since ?? now;
  return last && now - from < LASTING ? { ...standing, since: from } : { ...found, since: null };
}

/** What a name needs at least: its shortest, where it stands. */
function leastOf(spots: readonly Spot[], { sizes }: Label, last: Laid | null): Box[] {
  const place = last?.place ?? 0;
  return spots.flatMap((spot) => (spot.size === sizes.length - 1 && spot.place === place ? spot.box : []));
}

/** The places for each of its sizes that are within the picture, the best first. */
function spotsOf({ bar, sizes }: Label, picture: Picture): Spot[] {
  const seen = bar.right > 0 && bar.left < picture.width && bar.bottom > 0 && bar.top < picture.height;
  if (!seen) return [];
  return sizes.flatMap((written, size) => {
    const gap = size > 0 && size === sizes.length - 1 ? SHORT_GAP : GAP;
    const spots = placesOf(bar, written, gap, picture.width).map((box, place) => ({ box, size, place }));
    return spots.filter(({ box }) => within(box, picture));
  });
}

/** Above the bar, above it to either side, beside it, and once more above all that. */
function placesOf(bar: Box, { width, height }: Size, gap: number, picture: number): Box[] {
  const middle = (bar.left + bar.right - width) / 2;
  const above = bar.top - gap - height;
  const level = (bar.top + bar.bottom - height) / 2;
  const higher = above - height - gap / 2;
  const places = [
    [middle, above], [bar.right - width, above], [bar.left, above], [bar.left - gap - width, level], [bar.right + gap, level],
    [middle, higher], [bar.right - width, higher], [bar.left, higher],
  ] as const;
  return places.map(([x, y]) => {
    const left = Math.max(SIDE, Math.min(picture - SIDE - width, x));
    return { left, top: y, right: left + width, bottom: y + height };
  });
}

function within(box: Box, { width, height, top }: Picture): boolean {
  return box.left >= SIDE && box.right <= width - SIDE && box.top >= top && box.bottom <= height;
}

/** Whether a box, and as much about it as `margin`, covers none of these. */
function isFree(box: Box, taken: readonly Box[], margin = 0): boolean {
  return !taken.some((other) => overlaps(box, other, margin));
}
