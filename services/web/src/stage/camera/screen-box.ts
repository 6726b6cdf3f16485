/** Where things of the stage are on the screen. */
import type { Camera, Vector3 } from "three";

/** CSS pixels, y down. */
export interface ScreenBox {
  left: number;
  top: number;
  right: number;
  bottom: number;
}

/** World metres to all sides of a place, as the camera sees them. */
export interface WorldExtent {
  across: number;
  up: number;
  down: number;
}

/** The box on a screen of `width` by `height` about the world place `at`. */
export function projectBox(
  position: Vector3,
  { across, up, down }: WorldExtent,
  camera: Camera,
  width: number,
  height: number,
): ScreenBox {
  const clip = position.clone().project(camera);
  const [x, y] = [(clip.x * 0.5 + 0.5) * width, (0.5 - clip.y * 0.5) * height];
  // pixels of a metre that stands up to the camera at this depth
  const depth = -position.clone().applyMatrix4(camera.matrixWorldInverse).z;
  const metre = (camera.projectionMatrix.elements[5] * height) / 2 / depth;
  return { left: x - across * metre, top: y - up * metre, right: x + across * metre, bottom: y + down * metre };
}

/** Whether two boxes share any area, or would with `room` between them. */
export function overlaps(a: ScreenBox, b: ScreenBox, margin = 0): boolean {
  return (
    a.left - margin < b.right && b.left < a.right + margin && a.top - margin < b.bottom && b.top < a.bottom + margin
  );
}
