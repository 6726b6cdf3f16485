/**
 * Recorder of the audience's camera over the last ten minutes, as sparse keyframes. The segments between keyframes stay
 * within `POSITION_TOLERANCE_M` and `FOV_TOLERANCE_RAD` of every sample. Method: swing filter. Each sample narrows the
 * range of slopes that a segment from the last keyframe may have; the first sample outside that range starts a new
 * segment.
 */
import type { CameraKeyframe } from "../../client/api";
import { RowQueue } from "./row-queue";
import type { CameraView } from "./view";

/** Tolerance of the camera's position and of the point it looks at, in metres. */
export const POSITION_TOLERANCE_M = 0.002;
/** Tolerance of the field of view, in radians. */
export const FOV_TOLERANCE_RAD = (0.2 * Math.PI) / 180;
/** Age after which keyframes are dropped, in microseconds. */
export const MAX_AGE_US = 600e6;
/** Maximum number of keyframes: as many as a recording may have. */
export const MAX_KEYFRAMES = 36_000;

const CAMERA_NUMBERS = 7;
/** Per coordinate, so that three together stay within the tolerance. */
const TOLERANCES = [0, 1, 2, 3, 4, 5].map(() => POSITION_TOLERANCE_M / Math.sqrt(3)).concat(FOV_TOLERANCE_RAD);

/** Clock time, then the seven numbers of a camera. */
type Sample = Float64Array;

const SAMPLE_LENGTH = 1 + CAMERA_NUMBERS;

export class CameraRecorder {
  readonly #keyframes = new RowQueue(SAMPLE_LENGTH);
  /** Last keyframe, where the current segment begins. */
  #lastKeyframe: Sample | null = null;
  /** Newest sample, where the current segment may end. */
  #newest: Sample | null = null;
  /** Clock time of the last view that the user had changed. */
  #lastMovedUs = -Infinity;
  readonly #minSlopes = new Float64Array(CAMERA_NUMBERS);
  readonly #maxSlopes = new Float64Array(CAMERA_NUMBERS);

  /**
   * Record the view at clock time `time`, in microseconds. `isCustomView` marks a view that the user changed. Samples
   * that are not later than the last are ignored.
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
   * Return the keyframes between two clock times and the neighbours on both sides, so that the camera is known
   * throughout, in ascending order.
   */
  keyframes(begin = -Infinity, end = Infinity): CameraKeyframe[] {
    const all = Array.from({ length: this.#keyframes.length }, (_, index) => this.#keyframes.at(index) as Sample);
    if (this.#newest) all.push(this.#newest);
    const first = Math.max(
      0,
      all.findLastIndex((key) => key[0] <= begin),
    );
    const after = all.findIndex((key) => key[0] >= end);
    return all.slice(first, after < 0 ? all.length : after + 1).map(toKeyframe);
  }

  /** Return the keyframes as `keyframes` does, but none if the user has not changed the view since `begin`. */
  movedKeyframes(begin = -Infinity, end = Infinity): CameraKeyframe[] {
    return this.#lastMovedUs > begin ? this.keyframes(begin, end) : [];
  }

  clear(): void {
    this.#keyframes.clear();
    this.#lastKeyframe = this.#newest = null;
    this.#lastMovedUs = -Infinity;
  }

  #startSegment(key: Sample): Sample {
    this.#lastKeyframe = key;
    this.#keyframes.push(key);
    this.#newest = null;
    this.#minSlopes.fill(-Infinity);
    this.#maxSlopes.fill(Infinity);
    // Keep the keyframe before the oldest remembered time: its segment starts there.
    const before = this.#keyframes.countUpTo(key[0] - MAX_AGE_US) - 1;
    this.#keyframes.drop(Math.max(before, this.#keyframes.length - MAX_KEYFRAMES, 0));
    return key;
  }

  /** Return whether a segment from the last keyframe to `sample` is within the tolerance of all samples between. */
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

/** Rounds to 0.1 mm and 0.1 mrad. */
function toKeyframe(sample: Sample): CameraKeyframe {
  const [x, y, z, gx, gy, gz, fov] = Array.from(sample.subarray(1), (value) => Math.round(value * 1e4) / 1e4);
  return { time: Math.round(sample[0]), position: [x, y, z], gaze: [gx, gy, gz], fov };
}
