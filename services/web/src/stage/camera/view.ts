/** Camera views: interpolation, and adaptation to the window's shape. */
import { Vector3 } from "three";

/** Position and target in world metres; `fov` is the vertical field of view in radians. Up is y. */
export interface CameraView {
  readonly position: Vector3;
  readonly gaze: Vector3;
  fov: number;
}

/** Aspect ratio below which the field of view is widened, so that the sides of the view at this ratio stay visible. */
export const MIN_ASPECT = 4 / 5;

/** Minimum distance between a camera and its target, in metres: nearer, there is no direction. */
const MIN_DISTANCE_M = 1e-3;

export function createView(): CameraView {
  return { position: new Vector3(0, 1, 4), gaze: new Vector3(0, 1, 0), fov: 0.5 };
}

/** Write the seven numbers of a camera (`proto/codec.md`, 2.14) into a view. */
export function viewFromNumbers(numbers: ArrayLike<number>, out: CameraView): void {
  out.position.set(numbers[0], numbers[1], numbers[2]);
  out.gaze.set(numbers[3], numbers[4], numbers[5]);
  out.fov = numbers[6];
}

/** Return the vertical field of view, in radians, for an aspect ratio: as recorded, or wider in narrow windows. */
export function fovForAspect(fov: number, aspect: number): number {
  return 2 * Math.atan(Math.tan(fov / 2) * Math.max(1, MIN_ASPECT / aspect));
}

/**
 * Write the view at `share` (0..1) of the way from `a` to `b`. The camera swings around its target by the shorter way
 * and never over the top, so that it does not pass through a performer; distance and zoom change evenly.
 */
export function interpolateViews(a: CameraView, b: CameraView, share: number, out: CameraView): void {
  const [from, to] = [toSpherical(a), toSpherical(b)];
  const mix = (x: number, y: number) => x + share * (y - x);
  const turn = Math.atan2(Math.sin(to.azimuth - from.azimuth), Math.cos(to.azimuth - from.azimuth));
  const azimuth = from.azimuth + share * turn;
  const elevation = mix(from.elevation, to.elevation);
  const distance = Math.exp(mix(Math.log(from.distance), Math.log(to.distance)));
  const flat = distance * Math.cos(elevation);
  out.gaze.lerpVectors(a.gaze, b.gaze, share);
  out.position.set(flat * Math.sin(azimuth), distance * Math.sin(elevation), flat * Math.cos(azimuth)).add(out.gaze);
  out.fov = 2 * Math.atan(Math.exp(mix(Math.log(Math.tan(a.fov / 2)), Math.log(Math.tan(b.fov / 2)))));
}

function toSpherical({ position, gaze }: CameraView): { azimuth: number; elevation: number; distance: number } {
  const offset = position.clone().sub(gaze);
  const elevation = Math.atan2(offset.y, Math.hypot(offset.x, offset.z));
  return { azimuth: Math.atan2(offset.x, offset.z), elevation, distance: Math.max(offset.length(), MIN_DISTANCE_M) };
}
