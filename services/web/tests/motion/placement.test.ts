import { expect, test } from "vitest";
import { applyPlacement, STAGE_CENTRE } from "../../src/motion/placement";
import { fromRotationVector } from "../../src/motion/rotation";
import { copyPose, createWorldTransforms, restPose, worldTransforms } from "../../src/motion/skeleton";
import { goldenTrack } from "../golden-motion";

/** Return a pose with every joint bent, off the centre. */
function bentPose() {
  const pose = restPose();
  pose.root.set([1, 0.9, 4]);
  for (let joint = 0; joint < 18; joint++)
    fromRotationVector(pose.rotations, joint * 4, 0.1 * joint, 0.4 - 0.05 * joint, 0.2);
  return pose;
}

test("a placement rotates and then translates", () => {
  const pose = restPose();
  pose.root.set([1, 0.9, 4]);
  expect(applyPlacement(pose, { x: 2, z: -3, turn: Math.PI / 2 })).toBe(pose);
  // (1, 4) rotated from z towards x is (4, -1).
  [6, 0.9, -4].forEach((value, i) => expect(pose.root[i]).toBeCloseTo(value, 12));
  [Math.SQRT1_2, 0, Math.SQRT1_2, 0].forEach((value, i) => expect(pose.rotations[i]).toBeCloseTo(value, 12));
});

test("all joints of a figure move with its placement", () => {
  const { figure } = goldenTrack(),
    pose = bentPose();
  const before = worldTransforms(figure, pose, createWorldTransforms());
  const [x, z, turn] = [-1.5, 0.25, 2.1];
  const after = worldTransforms(figure, applyPlacement(pose, { x, z, turn }), createWorldTransforms());
  for (let joint = 0; joint < 18; joint++) {
    const [ax, ay, az] = before.positions.subarray(joint * 3, joint * 3 + 3);
    const expected = [x + Math.cos(turn) * ax + Math.sin(turn) * az, ay, z + Math.cos(turn) * az - Math.sin(turn) * ax];
    expected.forEach((value, i) => expect(after.positions[joint * 3 + i]).toBeCloseTo(value, 12));
  }
});

test("the stage's centre does not change a pose, bit for bit", () => {
  const pose = bentPose(),
    before = restPose();
  copyPose(pose, before);
  expect(applyPlacement(pose, STAGE_CENTRE)).toEqual(before);
});
