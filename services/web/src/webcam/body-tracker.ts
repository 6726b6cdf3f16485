/** Pose of a performer from the landmarks of successive pictures: rotations and position, smoothed. Pure. */
import { OneEuro } from "../input/one-euro";
import { JOINT_COUNT, type Pose } from "../motion/skeleton";
import { BodyPosition } from "./body-position";
import { BodyRotations } from "./body-rotations";
import type { DetectedBody } from "./landmark";
import { PersonTracker, type Tracking } from "./person-tracker";

export interface TrackedBody extends Tracking {
  /** Pose of the figure of `body-figure.ts`; null while nobody is followed. */
  readonly pose: Pose | null;
  /** True if the picture shows the feet. */
  readonly hasFeet: boolean;
}

/** Smoothing of the rotations, in units of a quaternion per second: little lag when they are fast. */
const SMOOTHING = { minCutoff: 1.5, beta: 4, derivativeCutoff: 1 };

export class BodyTracker {
  readonly #person = new PersonTracker();
  readonly #rotations = new BodyRotations();
  readonly #position = new BodyPosition();
  readonly #filters = Array.from({ length: JOINT_COUNT }, () => new OneEuro(4, SMOOTHING));
  readonly #smoothed = new Float64Array(JOINT_COUNT * 4);

  /** Calibrate again. */
  recalibrate(): void {
    this.#person.recalibrate();
  }

  /** Follow the person in a picture: see `PersonTracker.update`. */
  update(body: DetectedBody | null, aspect: number, seconds: number): TrackedBody {
    const { person, ...tracking } = this.#person.update(body, aspect, seconds);
    if (person === null) this.#position.reset();
    if (!body || !person?.view) {
      for (const filter of this.#filters) filter.reset();
      return { ...tracking, pose: null, hasFeet: false };
    }
    const rotations = this.#smooth(this.#rotations.update(body.world), seconds);
    const root = this.#position.update(person, rotations, seconds);
    return { ...tracking, pose: { root, rotations }, hasFeet: person.view.lowerAnkle !== null };
  }

  #smooth(rotations: Float64Array, seconds: number): Float64Array {
    const smoothed = this.#smoothed;
    this.#filters.forEach((filter, joint) => {
      const rotation = rotations.slice(joint * 4, joint * 4 + 4);
      const previous = smoothed.subarray(joint * 4, joint * 4 + 4);
      // A quaternion and its negative are the same rotation.
      if (rotation.reduce((sum, value, i) => sum + value * previous[i], 0) < 0)
        for (let i = 0; i < 4; i++) rotation[i] = -rotation[i];
      const value = filter.filter(rotation, seconds);
      const length = Math.hypot(...value);
      for (let i = 0; i < 4; i++) previous[i] = value[i] / length;
    });
    return smoothed.slice();
  }
}
