/** Bands of the picture that contain its edges: together they are smaller than the box around all edges. */
import type { ScreenBox } from "../camera/screen-box";

/**
 * Return the parts of boxes inside a canvas of this size without its outermost pixels, which lack neighbours; in shares
 * of the canvas.
 */
export function insideBorder(boxes: readonly ScreenBox[], width: number, height: number): ScreenBox[] {
  const [x, y] = [1 / width, 1 / height];
  return boxes
    .map(({ left, top, right, bottom }) => ({
      left: Math.max(left, x),
      top: Math.max(top, y),
      right: Math.min(right, 1 - x),
      bottom: Math.min(bottom, 1 - y),
    }))
    .filter(({ left, top, right, bottom }) => right > left && bottom > top);
}

/** Return `count` bands of equal height from the top to the bottom of the boxes, each as wide as the boxes in it. */
export function bandsOf(boxes: readonly ScreenBox[], count: number): ScreenBox[] {
  const top = Math.min(...boxes.map((box) => box.top));
  const height = (Math.max(...boxes.map((box) => box.bottom)) - top) / count;
  return Array.from({ length: count }, (_, band) => {
    const [start, end] = [top + band * height, top + (band + 1) * height];
    const inside = boxes.filter((box) => box.top < end && box.bottom > start);
    return {
      left: Math.min(...inside.map((box) => box.left)),
      top: start,
      right: Math.max(...inside.map((box) => box.right)),
      bottom: end,
    };
  }).filter(({ left, right }) => right > left);
}
