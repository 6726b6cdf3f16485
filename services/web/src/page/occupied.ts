/** Where parts of the page stand before the picture. */
import type { Box } from "../stage/boxes";

export interface Occupied {
  /** The boxes of all that are shown, CSS pixels. */
  readonly boxes: readonly Box[];
  /** One of them has another place, though not another size. */
  moved(): void;
}

/** The boxes of `parts` are asked for only when one of them or the window has changed: each time the page is laid out for it. */
export function createOccupied(parts: readonly Element[]): Occupied {
  let boxes: Box[] | null = null;
  const moved = () => (boxes = null);
  const sizes = new ResizeObserver(moved);
  for (const part of parts) sizes.observe(part);
  addEventListener("resize", moved);
  return {
    get boxes() {
      return (boxes ??= parts.map((part) => part.getBoundingClientRect()).filter(({ width, height }) => width > 0 && height > 0));
    },
    moved,
  };
}
