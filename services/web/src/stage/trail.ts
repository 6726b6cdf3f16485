/**
 * Where the audience's camera was during the last ten minutes, as sparse keyframes: straight lines between them are as near to
 * all that was seen as `NEAR` and `NEAR_ANGLE` say (the swing filter: the slopes that a line from the last keyframe may have are
 * narrowed by every sample, and the first that none of them reaches ends it).
 */
import type { CameraKeyframe } from "../client/library";
import { Rows } from "./rows";
import type { View } from "./view";

/** How far a line may be off the camera's position, and off the point it gazes at, metres. */
export const NEAR = 0.002;
/** How far off its field of view, radians. */
export const NEAR_ANGLE = (0.2 * Math.PI) / 180;
/** Microseconds that are remembered. */
export const REMEMBERED = 600e6;
/** More keyframes than this are never held: as many as a kept session may have. */
export const MOST = 36_000;

const NUMBERS = 7;
/** Of each number, so that three of them together are within the bound. */
const SLACK = [0, 1, 2, 3, 4, 5].map(() => NEAR / Math.sqrt(3)).concat(NEAR_ANGLE);

/** Clock time, then the seven numbers of a camera. */
type Sample = Float64Array;

const SAMPLE = 1 + NUMBERS;

export class CameraTrail {
  readonly #keys = new Rows(SAMPLE);
  /** The last of them, where the line that goes on begins. */
  #key: Sample | null = null;
  /** The newest sample, where a line from the last keyframe may end. */
  #newest: Sample | null = null;
  /** When the view was moved last. */
  #moved = -Infinity;
  readonly #lowest = new Float64Array(NUMBERS);
  readonly #highest = new Float64Array(NUMBERS);

  /**
   * Notes the view at clock time `time`, microseconds, and whether it is `moved`: other than what everyone sees who touches
   * nothing. A time that is not after the last is passed over.
   */
  add(time: number, { position, gaze, fov }: View, moved = true): void {
    const sample = Float64Array.of(time, position.x, position.y, position.z, gaze.x, gaze.y, gaze.z, fov);
    if (!sample.every(Number.isFinite)) return;
    const last = this.#newest ?? this.#key;
    if (last && time <= last[0]) return;
    if (moved) this.#moved = time;
    let key = this.#key;
    if (key && this.#newest && !this.#reaches(key, sample)) key = this.#begin(this.#newest);
    if (!key) {
      this.#begin(sample);
      return;
    }
    this.#narrow(key, sample);
    this.#newest = sample;
  }

  /**
   * Keyframes between two clock times, and those next to them on either side, so that the camera is known all along; ascending.
   */
  keyframes(begin = -Infinity, end = Infinity): CameraKeyframe[] {
    const all = Array.from({ length: this.#keys.length }, (_, nth) => this.#keys.at(nth) as Sample);
    if (this.#newest) all.push(this.#newest);
    const first = Math.max(0, all.findLastIndex((key) => key[0] <= begin));
    const after = all.findIndex((key) => key[0] >= end);
    return all.slice(first, after < 0 ? all.length : after + 1).map(keyframe);
  }

  /** As `keyframes`, but none where the camera was not moved since `begin`: then there is nothing to keep of it. */
  moves(begin = -Infinity, end = Infinity): CameraKeyframe[] {
    return this.#moved > begin ? this.keyframes(begin, end) : [];
  }

  clear(): void {
    this.#keys.clear();
    this.#key = this.#newest = null;
    this.#moved = -Infinity;
  }

  /** A line starts here. */
  #begin(key: Sample): Sample {
    this.#key = key;
    this.#keys.push(key);
    this.#newest = null;
    this.#lowest.fill(-Infinity);
    this.#highest.fill(Infinity);
    // the one before the oldest that is remembered is where its line comes from
    const before = this.#keys.until(key[0] - REMEMBERED) - 1;
    this.#keys.drop(Math.max(before, this.#keys.length - MOST, 0));
    return key;
  }

  /** Whether a line from the last keyframe to `sample` passes near all samples since. */
  #reaches(key: Sample, sample: Sample): boolean {
    const span = sample[0] - key[0];
    for (let n = 0; n < NUMBERS; n++) {
      const slope = (sample[n + 1] - key[n + 1]) / span;
      if (slope < this.#lowest[n] || slope > this.#highest[n]) return false;
    }
    return true;
  }

  #narrow(key: Sample, sample: Sample): void {
    const span = sample[0] - key[0];
    for (let n = 0; n < NUMBERS; n++) {
      const step = sample[n + 1] - key[n + 1];
      this.#lowest[n] = Math.max(this.#lowest[n], (step - SLACK[n]) / span);
      this.#highest[n] = Math.min(this.#highest[n], (step + SLACK[n]) / span);
    }
  }
}

/** Tenths of millimetres and of milliradians are enough. */
function keyframe(sample: Sample): CameraKeyframe {
  const [x, y, z, gx, gy, gz, fov] = Array.from(sample.subarray(1), (value) => Math.round(value * 1e4) / 1e4);
  return { time: Math.round(sample[0]), position: [x, y, z], gaze: [gx, gy, gz], fov };
}
