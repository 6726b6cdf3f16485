/**
 * Calibration by standing still: the length of the person's arms in metres of the model, which knows nobody's size. The
 * arms give it if they hang in view, else the shoulders, so that it also works for a person who sits at a desk. The
 * size of the person in the picture is kept too, as the reference for later pictures. Pure.
 */
import { type ArmView, type BodyView, SIDES } from "./body-view";

/** Time to stand still, in seconds. */
export const STILL_S = 1;
/** Samples that this time must contain. */
const MIN_SAMPLES = 5;
/** Movement of a shoulder that counts as standing still, in shoulder widths. */
const MAX_MOVEMENT = 0.12;
const MIN_VISIBILITY = 0.5;
/** Length of an arm from shoulder to wrist per shoulder width. */
const TYPICAL_ARM = 1.5;
/** Measured lengths beyond these shares of the typical one are arms that point at the camera, or errors. */
const ARM_RANGE = [0.9, 1.25] as const;

/** Measures of a person who stands still. */
export interface Stature {
  /** Length of an arm from shoulder to wrist in metres of the model. */
  readonly armLength: number;
  /** As in `BodyView`. */
  readonly scale: number;
  readonly trunk: number | null;
}

interface Sample {
  readonly seconds: number;
  readonly view: BodyView;
}

export class Calibration {
  #samples: Sample[] = [];
  #stature: Stature | null = null;

  /** Null until the person has stood still. */
  get stature(): Stature | null {
    return this.#stature;
  }

  /** Share of the time for which the person has stood still, 0 to 1. */
  get progress(): number {
    if (this.#stature !== null) return 1;
    const [first, last] = [this.#samples[0], this.#samples.at(-1)];
    return first && last ? Math.min(1, (last.seconds - first.seconds) / STILL_S) : 0;
  }

  /** Start again. */
  reset(): void {
    this.#samples = [];
    this.#stature = null;
  }

  /** Add what a picture shows; null if it shows no person. */
  add(view: BodyView | null, seconds: number): void {
    if (this.#stature !== null) return;
    if (!view || SIDES.some((side) => view[side].shoulderVisibility < MIN_VISIBILITY)) {
      this.#samples = [];
      return;
    }
    // Samples from before a movement do not count.
    const lastMoved = this.#samples.findLastIndex((sample) => hasMoved(sample.view, view));
    this.#samples.splice(0, lastMoved + 1);
    this.#samples.push({ seconds, view });
    if (this.#samples.length >= MIN_SAMPLES && this.progress === 1)
      this.#stature = measure(this.#samples.map((sample) => sample.view));
  }
}

function hasMoved(from: BodyView, to: BodyView): boolean {
  const limit = MAX_MOVEMENT * to.shoulderWidth * to.scale;
  return SIDES.some(
    (side) =>
      Math.hypot(from[side].shoulder.x - to[side].shoulder.x, from[side].shoulder.y - to[side].shoulder.y) > limit,
  );
}

function measure(views: readonly BodyView[]): Stature {
  const trunks = views.flatMap(({ trunk }) => trunk ?? []);
  return {
    armLength: measureArm(views),
    scale: median(views.map(({ scale }) => scale)),
    trunk: trunks.length > views.length / 2 ? median(trunks) : null,
  };
}

function measureArm(views: readonly BodyView[]): number {
  const typical = TYPICAL_ARM * median(views.map(({ shoulderWidth }) => shoulderWidth));
  const scale = median(views.map((view) => view.scale));
  const seen = SIDES.flatMap((side) => {
    const arms = views.map((view) => view[side]).filter(({ armVisibility }) => armVisibility >= MIN_VISIBILITY);
    return arms.length > views.length / 2 ? [median(arms.map(picturedLength)) / scale] : [];
  }).filter((length) => length > typical * ARM_RANGE[0] && length < typical * ARM_RANGE[1]);
  return seen.length > 0 ? seen.reduce((sum, length) => sum + length) / seen.length : typical;
}

function picturedLength({ shoulder, elbow, wrist }: ArmView): number {
  return Math.hypot(elbow.x - shoulder.x, elbow.y - shoulder.y) + Math.hypot(wrist.x - elbow.x, wrist.y - elbow.y);
}

function median(values: readonly number[]): number {
  return values.toSorted((a, b) => a - b)[values.length >> 1];
}
