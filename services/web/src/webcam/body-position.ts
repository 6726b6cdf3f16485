/**
 * Position of a performer's root from the pictures of a camera. The feet stand on the floor; steps to the side and
 * towards the camera are measured in the picture, and so are jumps. Pure.
 */
import { OneEuro } from "../input/one-euro";
import { rotate } from "../motion/rotation";
import { createWorldTransforms, JOINTS, worldTransforms } from "../motion/skeleton";
import { ARM_M, bodyFigure, SOLE } from "./body-figure";
import { FOCAL_LENGTH } from "./body-view";
import type { Person } from "./person-tracker";

/** Farthest step from where the person was calibrated, in metres. */
const MAX_STEP_M = 1.5;
/** Height of the feet in the picture that may be an error of the person's size in it, in metres. */
const MIN_LIFT_M = 0.08;
/** Time constant with which the floor follows feet that seem to have left it, in seconds: longer than a jump. */
const FLOOR_TIME_S = 1;
const SMOOTHING = { minCutoff: 1.2, beta: 4, derivativeCutoff: 1 };

const ANKLES = ["l_ankle", "r_ankle"].map((name) => JOINTS.indexOf(name));

export class BodyPosition {
  readonly #figure = bodyFigure();
  readonly #world = createWorldTransforms();
  readonly #filter = new OneEuro(3, SMOOTHING);
  readonly #step = { x: 0, z: 0 };
  /** Place of the hips where the person was calibrated, in metres of the model: to the picture's right, and away. */
  #home: { x: number; distance: number } | null = null;
  /** Height of the floor, in metres of the model above the middle of the picture. */
  #floor: { height: number; seconds: number } | null = null;

  /** Start again, at the place where the person is next. */
  reset(): void {
    this.#filter.reset();
    this.#home = this.#floor = null;
    this.#step.x = this.#step.z = 0;
  }

  /** Return the root (3) in metres, y above the floor, for the local rotations (72) of the body in a picture. */
  update(person: Person, rotations: Float64Array, seconds: number): Float64Array {
    const perModelMetre = ARM_M / person.stature.armLength;
    this.#followHips(person, perModelMetre);
    const lift = Math.max(0, this.#heightOfFeet(person, seconds) - MIN_LIFT_M) * perModelMetre;
    const { x, z } = this.#step;
    return this.#filter.filter([x, this.#standingHeight(rotations) + lift, z], seconds);
  }

  /** Where the hips are not seen, the last step stays. */
  #followHips({ view, scale }: Person, perModelMetre: number): void {
    if (!view?.hips) return;
    const x = view.hips.x / scale;
    const distance = FOCAL_LENGTH / scale;
    this.#home ??= { x, distance };
    this.#step.x = clampStep((x - this.#home.x) * perModelMetre);
    this.#step.z = clampStep((this.#home.distance - distance) * perModelMetre);
  }

  /** Return how far the lower foot is above the floor, in metres of the model. */
  #heightOfFeet({ view, scale }: Person, seconds: number): number {
    if (view?.lowerAnkle == null) {
      this.#floor = null;
      return 0;
    }
    const height = view.lowerAnkle / scale;
    const before = this.#floor ?? { height, seconds };
    const share = height < before.height ? 1 : 1 - Math.exp((before.seconds - seconds) / FLOOR_TIME_S);
    this.#floor = { height: before.height + (height - before.height) * share, seconds };
    return height - this.#floor.height;
  }

  /** Return the height of the root with which the lower foot touches the floor. */
  #standingHeight(rotations: Float64Array): number {
    const root = new Float64Array(3);
    const { positions, orientations } = worldTransforms(this.#figure, { root, rotations }, this.#world);
    const point = new Float64Array(3);
    const heights = ANKLES.flatMap((ankle) =>
      SOLE.map((offset) => {
        rotate(point, 0, orientations, ankle * 4, Float64Array.from(offset), 0);
        return positions[ankle * 3 + 1] + point[1];
      }),
    );
    return -Math.min(...heights);
  }
}

function clampStep(metres: number): number {
  return Math.min(MAX_STEP_M, Math.max(-MAX_STEP_M, metres));
}
