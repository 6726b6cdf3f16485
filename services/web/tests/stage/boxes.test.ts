import { PerspectiveCamera, Vector3 } from "three";
import { expect, test } from "vitest";
import { boxAround } from "../../src/stage/boxes";

test("a box is as large on the screen as it is in the world at its depth", () => {
  const camera = new PerspectiveCamera(90, 2, 0.1, 100);
  camera.position.set(0, 1, 5);
  camera.updateMatrixWorld();
  // five metres away a right angle sees ten metres of height: 100 pixels a metre
  const box = boxAround(new Vector3(1, 2, 0), { across: 0.5, up: 0.2, down: 0.1 }, camera, 2000, 1000);
  const wanted = { left: 1050, top: 380, right: 1150, bottom: 410 };
  for (const side of ["left", "top", "right", "bottom"] as const) expect(box[side]).toBeCloseTo(wanted[side], 6);
});
