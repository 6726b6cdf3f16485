import * as fc from "fast-check";
import { expect, test } from "vitest";
import { rotate } from "../../src/motion/rotation";
import { createWorldTransforms, JOINTS, restPose, worldTransforms } from "../../src/motion/skeleton";
import { bodyFigure } from "../../src/webcam/body-figure";
import { BodyRotations } from "../../src/webcam/body-rotations";
import { LANDMARK, LANDMARK_STRIDE } from "../../src/webcam/landmark";
import { anyPose, determinedPose, landmarksOf, turned } from "./arbitrary-body";

const figure = bodyFigure();

/** Return the largest angle in radians between the rotations of two poses, over the joints. */
function largestDifference(a: Float64Array, b: Float64Array, joints = JOINTS): number {
  return Math.max(
    ...joints.map((name) => {
      const at = JOINTS.indexOf(name) * 4;
      const dot = [0, 1, 2, 3].reduce((sum, i) => sum + a[at + i] * b[at + i], 0);
      return 2 * Math.acos(Math.min(1, Math.abs(dot)));
    }),
  );
}

test("a body at rest has the rotations of the rest pose", () => {
  const rotations = new BodyRotations().update(landmarksOf(figure, restPose()));
  expect(largestDifference(rotations, restPose().rotations)).toBeLessThan(1e-6);
});

test("rotations that the landmarks determine are recovered", () => {
  fc.assert(
    fc.property(determinedPose, (pose) => {
      const rotations = new BodyRotations().update(landmarksOf(figure, pose));
      expect(largestDifference(rotations, pose.rotations)).toBeLessThan(1e-5);
    }),
  );
});

test("bones of arms and legs point where the landmarks say, whatever the pose", () => {
  fc.assert(
    fc.property(anyPose, (pose) => {
      const landmarks = landmarksOf(figure, pose);
      const rotations = new BodyRotations().update(landmarks);
      const { orientations } = worldTransforms(figure, { root: pose.root, rotations }, createWorldTransforms());
      for (const [joint, from, to] of [
        ["l_shoulder", LANDMARK.leftShoulder, LANDMARK.leftElbow],
        ["r_elbow", LANDMARK.rightElbow, LANDMARK.rightWrist],
        ["r_hip", LANDMARK.rightHip, LANDMARK.rightKnee],
        ["l_knee", LANDMARK.leftKnee, LANDMARK.leftAnkle],
      ] as const) {
        const bone = new Float64Array(3);
        rotate(bone, 0, orientations, JOINTS.indexOf(joint) * 4, Float64Array.of(0, -1, 0), 0);
        const seen = [0, 1, 2].map((axis) => {
          const difference = landmarks[to * LANDMARK_STRIDE + axis] - landmarks[from * LANDMARK_STRIDE + axis];
          return axis === 0 ? difference : -difference;
        });
        const size = Math.hypot(...seen);
        seen.forEach((value, axis) => void expect(bone[axis]).toBeCloseTo(value / size, 5));
      }
    }),
  );
});

test("all rotations are unit quaternions, whatever the landmarks", () => {
  const landmarks = fc
    .array(fc.oneof(fc.constant(0), fc.double({ min: -3, max: 3, noNaN: true })), { minLength: 132, maxLength: 132 })
    .map((values) => Float64Array.from(values));
  fc.assert(
    fc.property(landmarks, landmarks, (first, second) => {
      const body = new BodyRotations();
      body.update(first);
      const rotations = body.update(second);
      for (let joint = 0; joint < JOINTS.length; joint++)
        expect(Math.hypot(...rotations.subarray(joint * 4, joint * 4 + 4))).toBeCloseTo(1, 9);
    }),
  );
});

test("a turn of the whole body changes only the root", () => {
  fc.assert(
    fc.property(determinedPose, fc.double({ min: -3, max: 3, noNaN: true }), (pose, yaw) => {
      const still = new BodyRotations().update(landmarksOf(figure, pose)).slice();
      const moved = new BodyRotations().update(landmarksOf(figure, turned(pose, yaw)));
      expect(largestDifference(still, moved, JOINTS.slice(1))).toBeLessThan(1e-5);
    }),
  );
});

test("joints that are not seen keep their rotation", () => {
  fc.assert(
    fc.property(determinedPose, determinedPose, (seen, hidden) => {
      const body = new BodyRotations();
      const before = body.update(landmarksOf(figure, seen)).slice();
      const after = body.update(landmarksOf(figure, hidden, 0.2));
      expect(largestDifference(before, after)).toBeLessThan(1e-6);
    }),
  );
});

test("only the upper body is seen: the trunk follows the shoulders and is upright", () => {
  const pose = turned(restPose(), 0.4);
  const landmarks = landmarksOf(figure, pose);
  for (const name of ["Hip", "Knee", "Ankle", "Heel", "Toes"] as const)
    for (const side of ["left", "right"] as const) landmarks[LANDMARK[`${side}${name}`] * LANDMARK_STRIDE + 3] = 0.1;
  const rotations = new BodyRotations().update(landmarks);
  expect(largestDifference(rotations, pose.rotations)).toBeLessThan(1e-6);
});
