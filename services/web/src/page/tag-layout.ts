/** Where names stand: by their bars, and never over another name, a bar or the face. Pure; CSS pixels, y down. */
import type { Box } from "../stage/boxes";

/** A name of this size, and the bar that it belongs to. */
export interface Label {
  bar: Box;
  width: number;
  height: number;
}

/** A name's place, and which of the places by its bar that is: told again for the next frame it stays there as long as it can. */
export interface Laid {
  box: Box;
  place: number;
}

/** From a bar to its name. */
const GAP = 12;
/** A name comes back to a better place only where there is so much more room. */
const MORE = 10;
/** From the picture's sides. */
const SIDE = 8;
/** Places that are tried before the names are laid one after another, as well as each can: all there are of four names, and many of more. */
const MOST_TRIES = 5_000;

/**
 * The places of `labels`, in their order, null for null. `keep` are boxes that nothing may cover beside the bars, `before` what this told of the frame before;
 * the picture is `width` wide, and `top` is where it begins. The first labels have the first choice. Where there is not room for all, each covers as little as
 * it can.
 */
export function layLabels(labels: readonly (Label | null)[], keep: readonly Box[], before: readonly (Laid | null)[], width: number, top: number): (Laid | null)[] {
  const taken = [...keep, ...labels.flatMap((label) => label?.bar ?? [])];
  const choices = labels.map((label, nth) => {
    const last = before[nth]?.place ?? 0;
    return label && placesOf(label, width).map((box, place): Choice => ({ box, place, margin: place < last ? MORE : 0, out: Math.max(0, top - box.top) * label.width }));
  });
  const laid = layFree(choices, taken, { left: MOST_TRIES });
  if (laid) return laid;
  return choices.map((places) => {
    if (!places) return null;
    const [best] = places.map((choice) => ({ choice, covered: covered(choice, taken) })).sort((a, b) => a.covered - b.covered);
    const { box, place } = best.choice;
    taken.push(box);
    return { box, place };
  });
}

/** A place by a bar, what it has to be free by, and how much of it is out of the picture. */
interface Choice extends Laid {
  margin: number;
  out: number;
}

/** The first choices that together cover nothing, null where there are none, or none was found in so many `tries`. */
function layFree([places, ...others]: readonly (readonly Choice[] | null)[], taken: readonly Box[], tries: { left: number }): (Laid | null)[] | null {
  if (places === undefined) return [];
  for (const choice of places ?? [null]) {
    if (choice && (tries.left-- <= 0 || covered(choice, taken) > 0)) continue;
    const rest = layFree(others, choice ? [...taken, choice.box] : taken, tries);
    if (rest) return [choice && { box: choice.box, place: choice.place }, ...rest];
  }
  return null;
}

/** How much a place covers of what is taken. */
function covered({ box, margin, out }: Choice, taken: readonly Box[]): number {
  return taken.reduce((sum, other) => sum + overlap(box, other, margin), out);
}

/** Above the bar, above it to either side, beside it, and once more above all that. */
function placesOf({ bar, width, height }: Label, picture: number): Box[] {
  const middle = (bar.left + bar.right - width) / 2;
  const above = bar.top - GAP - height;
  const level = (bar.top + bar.bottom - height) / 2;
  const places = [
    [middle, above], [bar.right - width, above], [bar.left, above], [bar.left - GAP - width, level], [bar.right + GAP, level],
    [middle, above - height - GAP / 2], [bar.right - width, above - height - GAP / 2], [bar.left, above - height - GAP / 2],
  ] as const;
  return places.map(([x, y]) => {
    const left = Math.max(SIDE, Math.min(picture - SIDE - width, x));
    return { left, top: y, right: left + width, bottom: y + height };
  });
}

/** The area that two boxes share, the one grown by `margin`. */
function overlap(a: Box, b: Box, margin: number): number {
  const across = Math.min(a.right, b.right) - Math.max(a.left, b.left) + margin;
  const down = Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top) + margin;
  return across > 0 && down > 0 ? across * down : 0;
}
