/** Where a camera stands, what it looks at and how wide: going from one view to another, and one view in any window. */
import { Vector3 } from "three";

/** World metres; `fov` is the vertical field of view in radians, up is y. */
export interface CameraView {
  readonly position: Vector3;
  readonly gaze: Vector3;
  fov: number;
}

/** Width over height below which a view is widened: what it shows from side to side at this shape is not cut off. */
export const MIN_ASPECT = 4 / 5;

/** Nearer than this a camera and what it looks at have no direction, metres. */
const MIN_DISTANCE_M = 1e-3;

export function createView(): CameraView {
  return { position: new Vector3(0, 1, 4), gaze: new Vector3(0, 1, 0), fov: 0.5 };
}

/** The seven numbers of a camera (`proto/SPEC.md`, Scene block) as a view. */
export function viewFromNumbers(numbers: ArrayLike<number>, out: CameraView): void {
  out.position.set(numbers[0], numbers[1], numbers[2]);
  out.gaze.set(numbers[3], numbers[4], numbers[5]);
  out.fov = numbers[6];
}

/** The vertical field of view, radians, in a window of `aspect` (width over height): as recorded, but on narrow ones wider. */
export function fovForAspect(fov: number, aspect: number): number {
  return 2 * Math.atan(Math.tan(fov / 2) * Math.max(1, MIN_ASPECT / aspect));
}

/**
 * The view at `share` (0..1) of the way from `a` to `b`: the camera swings about what it looks at, the shorter way round and
 * never over the top, so that it does not pass through the dancer; nearing and zooming are even.
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
  const away = position.clone().sub(gaze);
  const elevation = Math.atan2(away.y, Math.hypot(away.x, away.z));
  return { azimuth: Math.atan2(away.x, away.z), elevation, distance: Math.max(away.length(), MIN_DISTANCE_M) };
}
