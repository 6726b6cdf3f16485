/**
 * Where the audience's camera was during the last ten minutes, as sparse keyframes: straight lines between them are as near to
 * all that was seen as `NEAR` and `NEAR_ANGLE` say (the swing filter: the slopes that a line from the last keyframe may have are
 * narrowed by every sample, and the first that none of them reaches ends it).
 */
import type { CameraKeyframe } from "../../client/api";
import { RowQueue } from "./row-queue";
import type { CameraView } from "./view";

/** How far a line may be off the camera's position, and off the point it gazes at, metres. */
export const POSITION_TOLERANCE_M = 0.002;
/** How far off its field of view, radians. */
export const FOV_TOLERANCE_RAD = (0.2 * Math.PI) / 180;
/** Microseconds that are remembered. */
export const MAX_AGE_US = 600e6;
/** More keyframes than this are never held: as many as a kept session may have. */
export const MAX_KEYFRAMES = 36_000;

const CAMERA_NUMBERS = 7;
/** Of each number, so that three of them together are within the bound. */
const TOLERANCES = [0, 1, 2, 3, 4, 5].map(() => POSITION_TOLERANCE_M / Math.sqrt(3)).concat(FOV_TOLERANCE_RAD);

/** Clock time, then the seven numbers of a camera. */
type Sample = Float64Array;

const SAMPLE_LENGTH = 1 + CAMERA_NUMBERS;

export class CameraRecorder {
  readonly #keyframes = new RowQueue(SAMPLE_LENGTH);
  /** The last of them, where the line that goes on begins. */
  #lastKeyframe: Sample | null = null;
  /** The newest sample, where a line from the last keyframe may end. */
  #newest: Sample | null = null;
  /** When the view was moved last. */
  #lastMovedUs = -Infinity;
  readonly #minSlopes = new Float64Array(CAMERA_NUMBERS);
  readonly #maxSlopes = new Float64Array(CAMERA_NUMBERS);

  /**
   * Notes the view at clock time `time`, microseconds, and whether it is `moved`: other than what everyone sees who touches
   * nothing. A time that is not after the last is passed over.
   */
  add(time: number, { position, gaze, fov }: CameraView, isCustomView = true): void {
    const sample = Float64Array.of(time, position.x, position.y, position.z, gaze.x, gaze.y, gaze.z, fov);
    if (!sample.every(Number.isFinite)) return;
    const last = this.#newest ?? this.#lastKeyframe;
    if (last && time <= last[0]) return;
    if (isCustomView) this.#lastMovedUs = time;
    let key = this.#lastKeyframe;
    if (key && this.#newest && !this.#isWithinTolerance(key, sample)) key = this.#startSegment(this.#newest);
    if (!key) {
      this.#startSegment(sample);
      return;
    }
    this.#narrowSlopes(key, sample);
    this.#newest = sample;
  }

  /**
   * Keyframes between two clock times, and those next to them on either side, so that the camera is known all along; ascending.
   */
  keyframes(begin = -Infinity, end = Infinity): CameraKeyframe[] {
    const all = Array.from({ length: this.#keyframes.length }, (_, nth) => this.#keyframes.at(nth) as Sample);
    if (this.#newest) all.push(this.#newest);
    const first = Math.max(
      0,
      all.findLastIndex((key) => key[0] <= begin),
    );
    const after = all.findIndex((key) => key[0] >= end);
    return all.slice(first, after < 0 ? all.length : after + 1).map(toKeyframe);
  }

  /** As `keyframes`, but none where the camera was not moved since `begin`: then there is nothing to keep of it. */
  movedKeyframes(begin = -Infinity, end = Infinity): CameraKeyframe[] {
    return this.#lastMovedUs > begin ? this.keyframes(begin, end) : [];
  }

  clear(): void {
    this.#keyframes.clear();
    this.#lastKeyframe = this.#newest = null;
    this.#lastMovedUs = -Infinity;
  }

  /** A line starts here. */
  #startSegment(key: Sample): Sample {
    this.#lastKeyframe = key;
    this.#keyframes.push(key);
    this.#newest = null;
    this.#minSlopes.fill(-Infinity);
    this.#maxSlopes.fill(Infinity);
    // the one before the oldest that is remembered is where its line comes from
    const before = this.#keyframes.countUpTo(key[0] - MAX_AGE_US) - 1;
    this.#keyframes.drop(Math.max(before, this.#keyframes.length - MAX_KEYFRAMES, 0));
    return key;
  }

  /** Whether a line from the last keyframe to `sample` passes near all samples since. */
  #isWithinTolerance(key: Sample, sample: Sample): boolean {
    const span = sample[0] - key[0];
    for (let n = 0; n < CAMERA_NUMBERS; n++) {
      const slope = (sample[n + 1] - key[n + 1]) / span;
      if (slope < this.#minSlopes[n] || slope > this.#maxSlopes[n]) return false;
    }
    return true;
  }

  #narrowSlopes(key: Sample, sample: Sample): void {
    const span = sample[0] - key[0];
    for (let n = 0; n < CAMERA_NUMBERS; n++) {
      const step = sample[n + 1] - key[n + 1];
      this.#minSlopes[n] = Math.max(this.#minSlopes[n], (step - TOLERANCES[n]) / span);
      this.#maxSlopes[n] = Math.min(this.#maxSlopes[n], (step + TOLERANCES[n]) / span);
    }
  }
}

/** Tenths of millimetres and of milliradians are enough. */
function toKeyframe(sample: Sample): CameraKeyframe {
  const [x, y, z, gx, gy, gz, fov] = Array.from(sample.subarray(1), (value) => Math.round(value * 1e4) / 1e4);
  return { time: Math.round(sample[0]), position: [x, y, z], gaze: [gx, gy, gz], fov };
}
