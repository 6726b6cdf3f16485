/** Audience camera at rest, and measurements of its picture. */
import { Vector3 } from "three";
import { AudienceCamera, type Framing } from "../../../src/stage/camera/audience-camera";

/** Create a camera at rest in a window of this size in pixels. */
export function createCamera(framing: Framing, width: number, height: number, scale = 1): AudienceCamera {
  const audience = new AudienceCamera();
  audience.reducedMotion = true;
  audience.scale = scale;
  audience.setFraming(framing, height);
  audience.resize(width / height);
  audience.update(0, 0);
  return audience;
}

/** Return the height of a point in the picture, in pixels from the bottom. */
export function pixelsAbove(audience: AudienceCamera, y: number, height: number): number {
  return (new Vector3(0, y, 0).project(audience.camera).y * 0.5 + 0.5) * height;
}

/** Return the camera's angle about the performer, in radians. */
export function yaw({ camera }: AudienceCamera): number {
  return Math.atan2(camera.position.x, camera.position.z);
}

/** Advance the camera at 60 frames per second; `reach` is that of the hands in the picture. */
export function run(audience: AudienceCamera, seconds: number, reach = 0): void {
  for (let t = 0; t < seconds; t += 1 / 60) audience.update(1 / 60, reach);
}
