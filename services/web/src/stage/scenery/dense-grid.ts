/** Plane as a grid for colours at its corners, in software rendering. */
import { PlaneGeometry } from "three";

/** Return a grid that is denser at the middle of its width, and at its lower or upper edge. */
export function createDenseGrid(
  [width, height]: readonly [number, number],
  columns: number,
  rows: number,
  denseEdge: "lower" | "upper",
): PlaneGeometry {
  const grid = new PlaneGeometry(width, height, columns, rows);
  const { position } = grid.attributes;
  const sign = denseEdge === "lower" ? 1 : -1;
  for (let corner = 0; corner < position.count; corner++) {
    const x = position.getX(corner) / width;
    const away = 0.5 + (sign * position.getY(corner)) / height;
    position.setXY(corner, width * x * (0.4 + 2.4 * x * x), sign * height * (away * (0.5 + 0.5 * away * away) - 0.5));
  }
  return grid;
}
