import { expect, test } from "vitest";
import { createBackdrop, createBackdropUniforms } from "../../../src/stage/scenery/backdrop";
import { createBakedUniforms } from "../../../src/stage/scenery/baked-uniforms";
import { createVignetteUniforms } from "../../../src/stage/scenery/vignette";

/** Height of the plane's centre above the floor, in metres. */
const HEIGHT_M = 5;

/** Return the least distance of a corner from the disc's centre for the triangles of each group, in metres. */
function leastDistances(radius: number, height: number): number[][] {
  const uniforms = createBackdropUniforms();
  const backdrop = createBackdrop(uniforms, createVignetteUniforms(), createBakedUniforms());
  backdrop.usesSimpleMaterials = true;
  uniforms.discRadius.value = radius;
  uniforms.discCentre.value.set(0, height);
  backdrop.fitDisc();
  const { index, attributes, groups } = backdrop.mesh.geometry;
  expect(groups.map(({ materialIndex }) => materialIndex)).toEqual([0, 1]);
  expect(groups[0].count + groups[1].count).toBe(48 * 28 * 6);
  return groups.map(({ start, count }) =>
    Array.from({ length: count / 3 }, (_, triangle) =>
      Math.min(
        ...[0, 1, 2].map((corner) => {
          const at = index!.getX(start + 3 * triangle + corner);
          return Math.hypot(attributes.position.getX(at), attributes.position.getY(at) + HEIGHT_M - height);
        }),
      ),
    ),
  );
}

test("the disc and its surroundings are a group of their own, wherever it is", () => {
  for (const [radius, height] of [
    [1.06, 1.3],
    [2.4, 2.9],
  ]) {
    const [disc, ground] = leastDistances(radius, height);
    expect(Math.min(...ground)).toBeGreaterThan(radius + 0.4);
    expect(Math.min(...disc)).toBeLessThan(radius);
    // Far cells are not among them.
    expect(Math.max(...disc)).toBeLessThan(radius + 1.5);
  }
});
