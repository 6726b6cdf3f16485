/** Where parts of the page stand before the picture. */
import type { ScreenBox } from "../stage/camera/screen-box";

export interface OccupiedArea {
  /** The boxes of all that are shown, CSS pixels. */
  readonly boxes: readonly ScreenBox[];
  /** One of them has another place, though not another size. */
  invalidate(): void;
}

/** The boxes of `parts` are asked for only when one of them or the window has changed: each time the page is laid out for it. */
export function createOccupiedArea(parts: readonly Element[]): OccupiedArea {
  let boxes: ScreenBox[] | null = null;
  const moved = () => (boxes = null);
  const sizes = new ResizeObserver(moved);
  for (const part of parts) sizes.observe(part);
  addEventListener("resize", moved);
  return {
    get boxes() {
      return (boxes ??= parts
        .map((part) => part.getBoundingClientRect())
        .filter(({ width, height }) => width > 0 && height > 0));
    },
    invalidate: moved,
  };
}
