/**
 * What stands behind the dancer turns with a camera that goes round the stage, as a moon goes with one who walks: there is no
 * other side to it. From the seats of the audience it stands still.
 */
import { Group, Vector3 } from "three";
import type { CameraView } from "../camera/view";

/** A view this far to the side turns nothing, radians: as far as one turns it in the audience, and a little. */
export const MAX_SIDE_ANGLE_RAD = (28 * Math.PI) / 180;
/** How quickly it goes back once the audience's seat is taken again, 1/s. */
const RETURN_RATE = 3;

const place = new Vector3();
const gaze = new Vector3();

export class Scenery {
  readonly group = new Group();

  constructor() {
    this.group.name = "scenery";
  }

  /** Moves on by `seconds`; `own` says that the view is from the audience's own seat. */
  update(view: CameraView, isAudienceView: boolean, seconds: number): void {
    const { rotation, parent } = this.group;
    place.copy(view.position);
    gaze.copy(view.gaze);
    if (parent) for (const at of [place, gaze]) parent.worldToLocal(at);
    if (isAudienceView) rotation.y *= Math.exp(-RETURN_RATE * seconds);
    const off = Math.atan2(place.x - gaze.x, place.z - gaze.z) - rotation.y;
    const away = Math.atan2(Math.sin(off), Math.cos(off));
    const turned = rotation.y + away - Math.min(Math.max(away, -MAX_SIDE_ANGLE_RAD), MAX_SIDE_ANGLE_RAD);
    rotation.y = Math.atan2(Math.sin(turned), Math.cos(turned));
  }
}
