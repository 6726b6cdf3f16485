import { PerspectiveCamera, Vector3 } from "three";
import { expect, test } from "vitest";
import { ScreenProjection } from "../../../src/stage/camera/screen-projection";

/** Create a projection of 800 by 400 pixels: at 5 m the picture is 10 m high. */
function createProjection(): ScreenProjection {
  const camera = new PerspectiveCamera(90, 2, 0.1, 100);
  camera.position.set(0, 1, 5);
  camera.updateMatrixWorld();
  return Object.assign(new ScreenProjection(camera), { width: 800, height: 400 });
}

test("a world position is projected to CSS pixels, y down", () => {
  const { x, y } = createProjection().toScreen(new Vector3(1, 2, 0));
  expect(x).toBeCloseTo(440, 6);
  expect(y).toBeCloseTo(160, 6);
});

test("a pixel is projected back to the plane through a point", () => {
  const projection = createProjection();
  const position = new Vector3(-2, 0.5, 1);
  const { x, y } = projection.toScreen(position);
  expect(projection.fromScreen(x, y, new Vector3(4, 4, 1))?.distanceTo(position)).toBeLessThan(1e-6);
});

test("a plane behind the camera has no position under a pixel", () => {
  expect(createProjection().fromScreen(400, 200, new Vector3(0, 0, 9))).toBeNull();
});

test("the box around a position grows with its scale", () => {
  const box = createProjection().boxAt(new Vector3(0, 1, 0), { across: 0.5, up: 0.2, down: 0.1 }, 2);
  expect([box.left, box.right].map(Math.round)).toEqual([360, 440]);
  expect([box.top, box.bottom].map(Math.round)).toEqual([184, 208]);
});
