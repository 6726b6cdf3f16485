/** Screen areas where parts of the page cover the picture. */
import type { ScreenBox } from "../stage/camera/screen-box";

export interface OccupiedArea {
  /** Measure again: a part moved without changing its size. */
  invalidate(): void;
}

/**
 * Measure `parts` at the animation frame after one of them or the window has changed. `onChange` receives the boxes of
 * all visible parts, in CSS pixels.
 */
export function createOccupiedArea(
  parts: readonly Element[],
  onChange: (boxes: readonly ScreenBox[]) => void,
): OccupiedArea {
  let isFrameRequested = false;
  const measure = () => {
    isFrameRequested = false;
    const boxes = parts.map((part) => part.getBoundingClientRect());
    onChange(
      boxes
        .filter(({ width, height }) => width > 0 && height > 0)
        .map(({ left, top, right, bottom }) => ({ left, top, right, bottom })),
    );
  };
  const invalidate = () => {
    if (isFrameRequested) return;
    isFrameRequested = true;
    requestAnimationFrame(measure);
  };
  const sizes = new ResizeObserver(invalidate);
  for (const part of parts) sizes.observe(part);
  addEventListener("resize", invalidate);
  return { invalidate };
}
