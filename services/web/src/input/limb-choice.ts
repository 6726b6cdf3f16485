/** Choice of the limb that a hand in space reaches or points at. Pure: positions are arguments. */
import { type Ray, Vector3 } from "three";

/** A string that can be taken: from the limb's ring to the upper end of its thread, in world metres. */
export interface Reachable {
  readonly limb: number;
  readonly ring: Vector3;
  readonly top: Vector3;
}

/** A hand in the world: where it grips, and the ray along which it points (unit direction). Metres. */
export interface Reach {
  readonly position: Vector3;
  readonly ray: Ray;
  /** Distance within which the hand itself takes a string. */
  readonly distance: number;
}

/** Half the angle of the cone in which a string is pointed at, in radians. */
const POINTING_ANGLE_RAD = (5 * Math.PI) / 180;

const onRay = new Vector3();
const onString = new Vector3();

/** Return the limb of the nearest string within reach, else of the one that the ray points at; null for neither. */
export function chooseLimb(strings: readonly Reachable[], reach: Reach): number | null {
  return (
    nearest(strings, reach.distance, (string) => distanceTo(string, reach.position)) ??
    nearest(strings, POINTING_ANGLE_RAD, (string) => pointingAngle(string, reach.ray))
  );
}

function nearest(strings: readonly Reachable[], limit: number, measure: (string: Reachable) => number): number | null {
  let found: number | null = null;
  let least = limit;
  for (const string of strings) {
    const value = measure(string);
    if (value < least) [found, least] = [string.limb, value];
  }
  return found;
}

function distanceTo({ ring, top }: Reachable, position: Vector3): number {
  const along = onString.subVectors(top, ring);
  const share = along.lengthSq() > 0 ? position.clone().sub(ring).dot(along) / along.lengthSq() : 0;
  return along
    .multiplyScalar(Math.min(Math.max(share, 0), 1))
    .add(ring)
    .distanceTo(position);
}

/** Return the angle between a ray and the nearest place of a string, as seen from the ray's origin. */
function pointingAngle({ ring, top }: Reachable, ray: Ray): number {
  ray.distanceSqToSegment(ring, top, onRay, onString);
  const seen = onString.sub(ray.origin);
  return seen.lengthSq() > 0 ? seen.angleTo(ray.direction) : 0;
}
