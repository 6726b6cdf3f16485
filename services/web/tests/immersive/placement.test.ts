import { Matrix4, Vector3 } from "three";
import { expect, test } from "vitest";
import { MAX_DISTANCE_M, Placement } from "../../src/immersive/placement";

/** A viewer who stands at (x, z), 1.6 m high, and looks to the side by `turn` radians to the left of -z. */
function viewer(x: number, z: number, turn = 0, height = 1.6): Matrix4 {
  return new Matrix4().makeRotationY(turn).setPosition(x, height, z);
}
const SPOT = { centre: new Vector3(2, 0.1, -3), front: 0.7 };

const toStage = (placement: Placement, x: number, y: number, z: number) =>
  new Vector3(x, y, z).applyMatrix4(placement.matrix);

/** Return the turn of a place of the stage as seen from its centre, in radians about y from z towards x. */
const turnOf = ({ x, z }: Vector3) => Math.atan2(x - SPOT.centre.x, z - SPOT.centre.z);

test("a stage of life size stands on the floor before the viewer, who sees its front", () => {
  const placement = new Placement("1:1");
  placement.place(viewer(1, 2), SPOT);
  expect(toStage(placement, 1, 0, 1).distanceTo(SPOT.centre)).toBeLessThan(1e-9);
  const eyes = toStage(placement, 1, 1.6, 2);
  expect(eyes.y).toBeCloseTo(1.7);
  expect(Math.hypot(eyes.x - SPOT.centre.x, eyes.z - SPOT.centre.z)).toBeCloseTo(1);
  expect(turnOf(eyes)).toBeCloseTo(SPOT.front);
});

test("it is placed where the viewer looks, also if that is up or down", () => {
  const placement = new Placement("1:1");
  placement.place(viewer(0, 0, Math.PI / 2), SPOT);
  expect(toStage(placement, -1, 0, 0).distanceTo(SPOT.centre)).toBeLessThan(1e-9);
  const down = new Matrix4().makeRotationX(-Math.PI / 2 + 0.01).setPosition(0, 1.6, 0);
  placement.place(down, SPOT);
  expect(toStage(placement, 0, 0, -1).distanceTo(SPOT.centre)).toBeLessThan(1e-9);
});

test("a movement is as large on a stage of life size, and four times as large on a small one", () => {
  for (const [size, scale] of [
    ["1:1", 1],
    ["1:4", 4],
  ] as const) {
    const placement = new Placement(size);
    placement.place(viewer(0, 0), SPOT);
    expect(placement.stagePerRoom).toBe(scale);
    const movement = toStage(placement, 0.1, 1.2, 0.3).sub(toStage(placement, 0, 1, 0));
    expect(movement.length()).toBeCloseTo(scale * Math.hypot(0.1, 0.2, 0.3));
    expect(movement.y).toBeCloseTo(scale * 0.2);
  }
});

test("a small stage is at the height of a table, for those who sit or stand", () => {
  const heights = [1.2, 1.6, 0.4, 2.5].map((height) => {
    const placement = new Placement("1:4");
    placement.place(viewer(0, 0, 0, height), SPOT);
    expect(toStage(placement, 0, placement.floorHeight, -0.55).distanceTo(SPOT.centre)).toBeLessThan(1e-9);
    return placement.floorHeight;
  });
  expect(heights[0]).toBeCloseTo(0.58);
  expect(heights[1]).toBeCloseTo(0.98);
  expect(heights.slice(2)).toEqual([0.35, 1.1]);
});

test("a turn leaves the viewer where it is on the stage and turns the view to the left", () => {
  const placement = new Placement("1:4");
  const at = viewer(0.5, 0.2);
  placement.place(at, SPOT);
  const eyes = () => toStage(placement, 0.5, 1.6, 0.2);
  const ahead = () => toStage(placement, 0.5, 1.6, -0.8).sub(eyes());
  const [eyesBefore, aheadBefore] = [eyes(), ahead()];
  placement.turn(Math.PI / 6, at);
  expect(eyes().distanceTo(eyesBefore)).toBeLessThan(1e-9);
  const expected = aheadBefore.applyAxisAngle(new Vector3(0, 1, 0), Math.PI / 6);
  expect(ahead().distanceTo(expected)).toBeLessThan(1e-9);
});

test("another place of the stage is moved to where its centre was, and feet stay on the floor", () => {
  const placement = new Placement("1:1");
  placement.place(viewer(0, 0), SPOT);
  const near = SPOT.centre.clone().add(new Vector3(0.5 * MAX_DISTANCE_M, 1, 0));
  const far = SPOT.centre.clone().add(new Vector3(0, 1, 1.1 * MAX_DISTANCE_M));
  expect([placement.isFar(near), placement.isFar(far)]).toEqual([false, true]);
  placement.moveTo(far);
  expect(placement.isFar(far)).toBe(false);
  expect(toStage(placement, 0, 0, -1).distanceTo(far.clone().setY(0.1))).toBeLessThan(1e-9);
  placement.setGround(0.25);
  expect(toStage(placement, 0, 0, -1).y).toBeCloseTo(0.25);
});
