/** Boxes on the screen around objects of the stage. */
import type { Camera, Vector3 } from "three";

/** Bounds in CSS pixels, y down. */
export interface ScreenBox {
  left: number;
  top: number;
  right: number;
  bottom: number;
}

/** Extent around a world position as the camera sees it, in metres. */
export interface WorldExtent {
  across: number;
  up: number;
  down: number;
}

/** Return the box on a screen of `width` by `height` pixels around a world position. */
export function projectBox(
  position: Vector3,
  { across, up, down }: WorldExtent,
  camera: Camera,
  width: number,
  height: number,
): ScreenBox {
  const clip = position.clone().project(camera);
  const [x, y] = [(clip.x * 0.5 + 0.5) * width, (0.5 - clip.y * 0.5) * height];
  // Pixels per metre, perpendicular to the view, at this depth.
  const depth = -position.clone().applyMatrix4(camera.matrixWorldInverse).z;
  const pixelsPerMetre = (camera.projectionMatrix.elements[5] * height) / 2 / depth;
  return {
    left: x - across * pixelsPerMetre,
    top: y - up * pixelsPerMetre,
    right: x + across * pixelsPerMetre,
    bottom: y + down * pixelsPerMetre,
  };
}

/** Return whether two boxes overlap, or would if they were closer by `margin`. */
export function overlaps(a: ScreenBox, b: ScreenBox, margin = 0): boolean {
  return (
    a.left - margin < b.right && b.left < a.right + margin && a.top - margin < b.bottom && b.top < a.bottom + margin
  );
}

/** Return the smallest box around these (at least one). */
export function unionOf(boxes: readonly ScreenBox[]): ScreenBox {
  return {
    left: Math.min(...boxes.map(({ left }) => left)),
    top: Math.min(...boxes.map(({ top }) => top)),
    right: Math.max(...boxes.map(({ right }) => right)),
    bottom: Math.max(...boxes.map(({ bottom }) => bottom)),
  };
}
