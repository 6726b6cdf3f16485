import { describe, expect, test } from "vitest";
import { JOINTS, type Pose, restPose } from "../../src/motion/skeleton";
import { BodyTracker, type TrackedBody } from "../../src/webcam/body-tracker";
import { STILL_S } from "../../src/webcam/calibration";
import { turned } from "./arbitrary-body";
import { ASPECT, type DetectionOptions, detect } from "./detected-body";
import { FilmSession } from "./film-session";
import { ARMS_ASIDE, ARMS_DOWN, poseWith } from "./poses";

const FPS = 20;
/** At this distance the picture shows the feet. */
const DISTANCE = 3.5;
/** Height of the root of the standing figure, in metres. */
const STANDING_M = 0.82;

/** The knees bent by as much as the hips, so that the feet stay flat. */
const CROUCH = poseWith(
  Object.fromEntries(
    ["l", "r"].flatMap((side) => [
      [`${side}_hip`, [-1, 0, 0]],
      [`${side}_knee`, [2, 0, 0]],
      [`${side}_ankle`, [-1, 0, 0]],
    ]),
  ),
);
/** By how much the hips are lower then, in metres. */
const CROUCH_M = 0.84 * (1 - Math.cos(1));

class Session extends FilmSession<TrackedBody, BodyTracker> {
  constructor() {
    super(new BodyTracker(), FPS);
  }

  /** Show a picture until all that is smoothed is at rest, and return the pose. */
  settle(pose: Pose, options: DetectionOptions = {}): Pose {
    return this.show(detect(pose, { distance: DISTANCE, ...options }), 8).pose as Pose;
  }
}

function calibrated(options?: DetectionOptions): Session {
  const session = new Session();
  session.show(detect(ARMS_DOWN, { distance: DISTANCE, ...options }), STILL_S + 0.5);
  return session;
}

function rotationOf({ rotations }: Pose, joint: string): number[] {
  const at = JOINTS.indexOf(joint) * 4;
  return [...rotations.subarray(at, at + 4)];
}

function expectRoot({ root }: Pose, x: number, y: number, z: number): void {
  [x, y, z].forEach((value, axis) => void expect(root[axis]).toBeCloseTo(value, 2));
}

test("a pose follows the calibration and ends with the sight of the person", () => {
  const session = new Session();
  expect(session.show(null, 0.1)).toEqual({ phase: "searching", progress: 0, pose: null, hasFeet: false });
  expect(session.show(detect(ARMS_DOWN, { distance: DISTANCE }), STILL_S / 2)).toMatchObject({
    phase: "calibrating",
    pose: null,
  });
  expectRoot(session.settle(ARMS_DOWN), 0, STANDING_M, 0);
  expect(session.show(null, 0.1)).toMatchObject({ phase: "searching", pose: null });
});

test("arms, and turns of the whole body, are those of the person", () => {
  const pose = calibrated().settle(turned(ARMS_ASIDE, 0.5));
  for (const joint of ["humanoid_root", "l_shoulder", "r_shoulder"]) {
    const [found, expected] = [rotationOf(pose, joint), rotationOf(turned(ARMS_ASIDE, 0.5), joint)];
    const dot = found.reduce((sum, value, i) => sum + value * expected[i], 0);
    expect(2 * Math.acos(Math.min(1, Math.abs(dot)))).toBeLessThan(0.02);
  }
});

test("rotations are smoothed through the double cover of quaternions", () => {
  const session = calibrated();
  const angles = Array.from({ length: 60 }, (_, i) => (i / 59) * 2 * Math.PI);
  let previous = rotationOf(session.settle(restPose()), "humanoid_root");
  for (const yaw of angles) {
    const body = detect(turned(restPose(), yaw), { distance: DISTANCE });
    const pose = session.tracker.update(body, ASPECT, (session.now += 1 / FPS)).pose;
    if (!pose) continue;
    const rotation = rotationOf(pose, "humanoid_root");
    expect(Math.hypot(...rotation)).toBeCloseTo(1, 9);
    // At most what 60 steps of a turn need, with the smoothing's catching up.
    expect(Math.hypot(...rotation.map((value, i) => value - previous[i]))).toBeLessThan(0.35);
    previous = rotation;
  }
});

describe("position", () => {
  test("steps to the side and to the camera, in proportion to the figure, whatever the model's metre", () => {
    for (const modelScale of [0.8, 1, 1.3]) {
      const session = calibrated({ modelScale });
      expectRoot(session.settle(ARMS_DOWN, { modelScale, right: 0.4 }), 0.4, STANDING_M, 0);
      expectRoot(session.settle(ARMS_DOWN, { modelScale, distance: DISTANCE + 0.5 }), 0, STANDING_M, -0.5);
    }
  });

  test("no step is longer than the limit", () => {
    const { root } = calibrated({ distance: 5 }).settle(ARMS_DOWN, { distance: 9 });
    expect(root[2]).toBeCloseTo(-1.5, 6);
  });

  test("the feet stay on the floor when the knees bend", () => {
    expectRoot(calibrated().settle(CROUCH, { up: -CROUCH_M }), 0, STANDING_M - CROUCH_M, 0);
  });

  test("a jump lifts the figure, and it lands", () => {
    const session = calibrated();
    session.settle(ARMS_DOWN);
    const jump = session.showAll(detect(ARMS_DOWN, { distance: DISTANCE, up: 0.35 }), 0.4);
    const heights = jump.map(({ pose }) => pose?.root[1] ?? 0);
    expect(Math.max(...heights)).toBeGreaterThan(STANDING_M + 0.12);
    expectRoot(session.settle(ARMS_DOWN), 0, STANDING_M, 0);
  });

  test("a camera that is tilted does not lift the figure for long", () => {
    const session = calibrated();
    expectRoot(session.settle(ARMS_DOWN, { up: 0.1 }), 0, STANDING_M, 0);
  });

  test("without feet and hips the figure stands where it was", () => {
    const session = calibrated({ distance: 0.8 });
    const { hasFeet, pose } = session.show(detect(ARMS_DOWN, { distance: 0.8, right: 0.1 }), 0.05);
    expect(hasFeet).toBe(false);
    expectRoot(pose as Pose, 0, STANDING_M, 0);
  });

  test("a new calibration starts at the person's new place", () => {
    const session = calibrated();
    expectRoot(session.settle(ARMS_DOWN, { right: 0.4 }), 0.4, STANDING_M, 0);
    session.tracker.recalibrate();
    expectRoot(session.settle(ARMS_DOWN, { right: 0.4 }), 0, STANDING_M, 0);
  });
});
