/** Screen areas where parts of the page cover the picture. */
import type { ScreenBox } from "../stage/camera/screen-box";

export interface OccupiedArea {
  /** Boxes of all visible parts, in CSS pixels. */
  readonly boxes: readonly ScreenBox[];
  /** Measure again at the next access: a part moved without changing its size. */
  invalidate(): void;
}

/** Measure `parts`, but only after one of them or the window changed: each measurement forces a layout. */
export function createOccupiedArea(parts: readonly Element[]): OccupiedArea {
  let boxes: ScreenBox[] | null = null;
  const invalidate = () => (boxes = null);
  const sizes = new ResizeObserver(invalidate);
  for (const part of parts) sizes.observe(part);
  addEventListener("resize", invalidate);
  return {
    get boxes() {
      return (boxes ??= parts
        .map((part) => part.getBoundingClientRect())
        .filter(({ width, height }) => width > 0 && height > 0));
    },
    invalidate,
  };
}
