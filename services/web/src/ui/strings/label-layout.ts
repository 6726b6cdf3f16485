/**
 * Layout of the labels over the stage from frame to frame: name tags of limb holders, and the invitation beside a hand.
 * Reads no document: the page measures the labels, and the engine lays them out. CSS pixels, y down.
 */
import type { ScreenBox } from "../../stage/camera/screen-box";
import type { ScreenPosition } from "../../stage/camera/screen-projection";
import { performerOfLimb } from "../../wire/limbs";
import type { LimbState } from "../limb-state";
import { type LabelPlacement, type LabelViewport, layOutLabels, placeBeside, type Side, type Size } from "./tag-layout";

/** Sizes of the labels, and the space for them. */
export interface LabelMetrics {
  /** Sizes of the forms of each limb's tag, from the longest to the shortest; null for a limb without a tag. */
  readonly tags: readonly (readonly Size[] | null)[];
  /** Size of the invitation; null while it is not shown. */
  readonly invitation: Size | null;
  readonly viewport: LabelViewport;
  /** Boxes of other elements that cover the picture. */
  readonly obstacles: readonly ScreenBox[];
}

/** State of the stage that labels follow. */
export interface LabelAnchors {
  readonly limbs: readonly LimbState[];
  /** Control bars by limb number, null for those that are not on the stage. */
  readonly bars: readonly (ScreenBox | null)[];
  readonly faces: readonly ScreenBox[];
  /** Hand that the invitation stands beside. */
  readonly hand: ScreenPosition | null;
}

/** Upper left corner of a label, and the index of its form. */
export interface LabelPosition {
  readonly form: number;
  readonly left: number;
  readonly top: number;
}

/** Positions of the labels; null for a hidden one. */
export interface LabelPositions {
  readonly tags: readonly (LabelPosition | null)[];
  readonly invitation: LabelPosition | null;
}

/** Metrics of a page without labels. */
export const NO_LABELS: LabelMetrics = {
  tags: [],
  invitation: null,
  viewport: { width: 0, height: 0, top: 0 },
  obstacles: [],
};

/** Distance between the hand and the invitation. */
const INVITATION_DISTANCE_PX = 26;

export class LabelLayout {
  #metrics = NO_LABELS;
  #placements: readonly (LabelPlacement | null)[] = [];
  #invitationSide: Side | null = null;

  set metrics(metrics: LabelMetrics) {
    const { width, height } = this.#metrics.viewport;
    // In a viewport of another size all tags are placed anew.
    if (metrics.viewport.width !== width || metrics.viewport.height !== height) this.#placements = [];
    this.#metrics = metrics;
  }

  /**
   * Place each holder's tag beside the bar of its string, where it covers no other tag, bar, face or obstacle, and the
   * invitation clear of the tags. Tags of this page's user are placed first, then those of the `selected` performer.
   * `now` is in milliseconds.
   */
  update({ limbs, bars, faces, hand }: LabelAnchors, selected: number, now: number): LabelPositions {
    const { tags, viewport } = this.#metrics;
    const obstacles = [...faces, ...this.#metrics.obstacles];
    const labels = limbs.map(({ holder }, limb) => {
      const [bar, sizes] = [bars[limb], tags[limb]];
      if (!holder || !bar || !sizes) return null;
      return { bar, sizes, rank: holder.mine ? 0 : performerOfLimb(limb) === selected ? 1 : 2 };
    });
    this.#placements = layOutLabels(labels, obstacles, this.#placements, viewport, now);
    const boxes = this.#placements.flatMap((placement) => placement?.box ?? []);
    const taken = [...obstacles, ...labels.flatMap((label) => label?.bar ?? []), ...boxes];
    return {
      tags: this.#placements.map((placement) => (placement?.box ? positionOf(placement.box, placement.size) : null)),
      invitation: this.#placeInvitation(hand, faces, taken),
    };
  }

  #placeInvitation(
    hand: ScreenPosition | null,
    faces: readonly ScreenBox[],
    taken: readonly ScreenBox[],
  ): LabelPosition | null {
    const { invitation: size, viewport } = this.#metrics;
    if (!size || !hand) return null;
    const sides = sidesAwayFrom(faces, hand);
    const placed = placeBeside(hand, INVITATION_DISTANCE_PX, size, taken, viewport, this.#invitationSide, sides);
    if (!placed) return null;
    this.#invitationSide = placed.side;
    return positionOf(placed.box, 0);
  }
}

/** Return the position of a box, rounded to a tenth of a pixel, so that it does not change without need. */
function positionOf({ left, top }: ScreenBox, form: number): LabelPosition {
  return { form, left: Math.round(left * 10) / 10, top: Math.round(top * 10) / 10 };
}

/**
 * Return the sides of a hand at `point`, the best first: towards the performer, whose face is nearest, is the worst.
 */
function sidesAwayFrom(faces: readonly ScreenBox[], { x }: ScreenPosition): readonly Side[] {
  const offsets = faces.map(({ left, right }) => x - (left + right) / 2);
  const nearest = offsets.sort((a, b) => Math.abs(a) - Math.abs(b))[0] ?? 0;
  return nearest >= 0 ? [0, 2, 3, 1] : [1, 2, 3, 0];
}
