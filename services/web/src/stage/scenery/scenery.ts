/**
 * Group behind the performers that turns with a camera that circles the stage, since it has no back side. In the
 * audience view it does not turn.
 */
import { Group, Vector3 } from "three";
import type { CameraView } from "../camera/view";

/**
 * Angle of view to the side up to which nothing turns, in radians: slightly more than the orbit of the audience view.
 */
export const MAX_SIDE_ANGLE_RAD = (28 * Math.PI) / 180;
/** Rate of return in the audience view, in 1/s. */
const RETURN_RATE = 3;

const place = new Vector3();
const gaze = new Vector3();

export class Scenery {
  readonly group = new Group();

  constructor() {
    this.group.name = "scenery";
  }

  /** Advance by `seconds`. */
  update(view: CameraView, isAudienceView: boolean, seconds: number): void {
    const { rotation, parent } = this.group;
    place.copy(view.position);
    gaze.copy(view.gaze);
    if (parent) for (const at of [place, gaze]) parent.worldToLocal(at);
    if (isAudienceView) rotation.y *= Math.exp(-RETURN_RATE * seconds);
    const viewAngle = Math.atan2(place.x - gaze.x, place.z - gaze.z) - rotation.y;
    const excess = Math.atan2(Math.sin(viewAngle), Math.cos(viewAngle));
    const angle = rotation.y + excess - Math.min(Math.max(excess, -MAX_SIDE_ANGLE_RAD), MAX_SIDE_ANGLE_RAD);
    rotation.y = Math.atan2(Math.sin(angle), Math.cos(angle));
  }
}
