import { expect, test } from "vitest";
import { createDenseGrid } from "../../../src/stage/scenery/dense-grid";

test.each(["lower", "upper"] as const)(
  "a grid covers its plane and is denser in the middle and at its %s edge",
  (edge) => {
    const { position } = createDenseGrid([10, 4], 8, 6, edge).attributes;
    const across = Array.from({ length: 9 }, (_, corner) => position.getX(corner));
    const down = Array.from({ length: 7 }, (_, row) => position.getY(9 * row));
    expect([across[0], across[8]].map((x) => Math.round(x * 1e4) / 1e4)).toEqual([-5, 5]);
    expect([down[0], down[6]].map((y) => Math.round(y * 1e4) / 1e4)).toEqual([2, -2]);
    expect(across[5] - across[4]).toBeLessThan(across[8] - across[7]);
    const [upper, lower] = [down[0] - down[1], down[5] - down[6]];
    expect(edge === "upper" ? upper : lower).toBeLessThan(edge === "upper" ? lower : upper);
  },
);
