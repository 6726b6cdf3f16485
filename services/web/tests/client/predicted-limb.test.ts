import { describe, expect, test } from "vitest";
import { createMarionetteSolver } from "../../src/client/marionette-solver";
import { PredictedLimb } from "../../src/client/predicted-limb";
import { fromRotationVector } from "../../src/motion/rotation";
import { copyPose, LIMB_FIRST_JOINTS, type Pose, restPose } from "../../src/motion/skeleton";
import { figure, rotationAngle, table } from "../marionette/figure";

/** Target of each limb. */
const TARGETS = [
  [0.4, -0.3, 0.5],
  [-0.4, -0.3, 0.5],
  [0.9, 0, 0],
  [0.9, 0, 0],
];

/** Return a pose that oscillates at 0.7 Hz about all axes of all joints, with the elbows bent by 0.5 to 1.1 rad. */
function motionPose(seconds: number): Pose {
  const pose = restPose();
  for (let joint = 0; joint < 18; joint++) {
    const [x, y, z] = [0, 1, 2].map((axis) => 0.3 * Math.sin(4.4 * seconds + joint + 2 * axis));
    fromRotationVector(pose.rotations, 4 * joint, joint === 13 || joint === 16 ? x - 0.8 : x, y, z);
  }
  return pose;
}

/** Predicted limb that is drawn frame by frame. */
class SimulatedStage {
  readonly prediction: PredictedLimb;
  readonly solver = createMarionetteSolver(figure, [table, table]);
  pose = restPose();
  motion = restPose();
  now = 0;
  /** Maximum angular speed of a joint relative to the motion, radians per second. */
  maxSpeed = 0;
  isHeldByOther = false;
  isBonded = false;

  constructor(
    readonly limb: number,
    readonly fps: number,
  ) {
    this.prediction = new PredictedLimb(limb);
  }

  /** Draw a frame; `overlay` are the limb's joints as the session sends them, if it is controlled. */
  draw(overlay: Float64Array | null = null): void {
    const { motion, pose, limb, fps } = this;
    this.now += 1000 / fps;
    this.motion = motionPose(this.now / 1000);
    this.pose = restPose();
    copyPose(this.motion, this.pose);
    const first = 4 * LIMB_FIRST_JOINTS[limb];
    if (overlay) this.pose.rotations.set(overlay, first);
    const overlaidMask = overlay ? 1 << limb : 0;
    const frame = { performer: 0, pose: this.pose, motion: this.motion, overlaidMask, nowMs: this.now };
    this.prediction.apply({ ...frame, solver: this.solver }, this.isHeldByOther, this.isBonded ? "shown" : null);
    for (let joint = 0; joint < 72; joint += 4) {
      const motionStep = rotationAngle(this.motion.rotations, joint, motion.rotations, joint);
      const step = rotationAngle(this.pose.rotations, joint, pose.rotations, joint);
      if (joint < first || joint >= first + 12) {
        expect(this.pose.rotations.slice(joint, joint + 4)).toEqual(this.motion.rotations.slice(joint, joint + 4));
      }
      if (this.now > 2000 / fps) this.maxSpeed = Math.max(this.maxSpeed, (step - motionStep) * fps);
    }
  }

  claim(): void {
    const [x, y, z] = TARGETS[this.limb];
    this.prediction.target.claim(this.now);
    this.prediction.target.setTarget(x, y, z, this.now);
  }

  /** Return true if the limb is drawn as in the motion. */
  isInMotion(): boolean {
    return [0, 4, 8].every((at) => {
      const joint = 4 * LIMB_FIRST_JOINTS[this.limb] + at;
      return rotationAngle(this.pose.rotations, joint, this.motion.rotations, joint) < 1e-9;
    });
  }
}

const limbs = [0, 1, 2, 3].flatMap((limb) => [20, 60, 144].map((fps) => [limb, fps] as const));
/** Upper bound of the angular speed of a joint relative to the motion, radians per second. */
const MAX_JOINT_SPEED = 45;

test("free limb is unchanged", () => {
  const stage = new SimulatedStage(0, 60);
  for (let frame = 0; frame < 10; frame++) {
    stage.draw();
    expect(stage.pose).toEqual(stage.motion);
  }
});

describe("limb held by this page", () => {
  test.each(limbs)("limb %i at %i fps reaches its target and returns smoothly", (limb, fps) => {
    const stage = new SimulatedStage(limb, fps);
    for (let frame = 0; frame < fps / 2; frame++) stage.draw();
    expect(stage.isInMotion()).toBe(true);
    stage.claim();
    for (let frame = 0; frame < fps; frame++) stage.draw();
    const controlled = createMarionetteSolver(figure, [table, table]).limbs[limb];
    controlled.observePose(stage.pose.rotations, 0);
    TARGETS[limb].forEach((value, axis) => expect(controlled.position[axis]).toBeCloseTo(value, 6));
    stage.prediction.target.release();
    for (let frame = 0; frame < fps; frame++) stage.draw();
    expect(stage.isInMotion()).toBe(true);
    expect(stage.maxSpeed).toBeLessThan(MAX_JOINT_SPEED);
  });

  test("return in the session's overlays is not shown a second time", () => {
    const stage = new SimulatedStage(0, 60),
      shown: Float64Array[] = [];
    stage.draw();
    stage.claim();
    for (let frame = 0; frame < 60; frame++) {
      stage.draw();
      shown.push(stage.pose.rotations.slice(48, 60));
    }
    stage.prediction.target.release();
    for (let frame = 0; frame < 42; frame++) {
      stage.draw(shown[59]);
      shown.push(stage.pose.rotations.slice(48, 60));
    }
    expect(stage.isInMotion()).toBe(true);
    // the overlays show the return later
    for (const joints of shown.slice(60, 90)) {
      stage.draw(joints);
      expect(stage.isInMotion()).toBe(true);
    }
  });

  test("overlay that stays for over a second is blended in", () => {
    const stage = new SimulatedStage(0, 60),
      joints = new Float64Array(12).fill(0);
    joints[0] = joints[4] = joints[8] = 1;
    stage.draw();
    stage.claim();
    for (let frame = 0; frame < 30; frame++) stage.draw();
    stage.prediction.target.release();
    for (let frame = 0; frame < 150; frame++) stage.draw(joints);
    joints.forEach((value, i) => expect(stage.pose.rotations[48 + i]).toBeCloseTo(value, 9));
    expect(stage.maxSpeed).toBeLessThan(MAX_JOINT_SPEED);
  });
});

describe("limb held by another puppeteer", () => {
  const overlay = new Float64Array(12);
  fromRotationVector(overlay, 0, -1.2, 0.3, 0.2);
  fromRotationVector(overlay, 4, -0.6, 0, 0.1);
  fromRotationVector(overlay, 8, 0.2, 0, 0);

  test.each(limbs)("limb %i at %i fps is shown as sent, and blends without a jump", (limb, fps) => {
    const stage = new SimulatedStage(limb, fps);
    stage.draw(overlay);
    stage.claim();
    for (let frame = 0; frame < fps / 2; frame++) stage.draw(overlay);
    stage.isHeldByOther = true;
    for (let frame = 0; frame < fps / 2; frame++) stage.draw(overlay);
    overlay.forEach((value, i) => expect(stage.pose.rotations[4 * LIMB_FIRST_JOINTS[limb] + i]).toBeCloseTo(value, 9));
    stage.isHeldByOther = false;
    for (let frame = 0; frame < fps; frame++) stage.draw(overlay);
    const controlled = createMarionetteSolver(figure, [table, table]).limbs[limb];
    controlled.observePose(stage.pose.rotations, 0);
    TARGETS[limb].forEach((value, axis) => expect(controlled.position[axis]).toBeCloseTo(value, 6));
    expect(stage.maxSpeed).toBeLessThan(MAX_JOINT_SPEED);
  });

  test("hand claimed during its return starts at its shown position", () => {
    const stage = new SimulatedStage(0, 60);
    for (let frame = 0; frame < 10; frame++) stage.draw(overlay);
    const before = createMarionetteSolver(figure, [table, table]).limbs[0],
      after = createMarionetteSolver(figure, [table, table]).limbs[0];
    before.observePose(stage.pose.rotations, 0);
    stage.prediction.target.claim(stage.now);
    for (let frame = 0; frame < 60; frame++) stage.draw(overlay);
    after.observePose(stage.pose.rotations, 0);
    [0, 1, 2].forEach((axis) => expect(Math.abs(after.position[axis] - before.position[axis])).toBeLessThan(0.02));
  });
});

test("a bonded hand is shown as the session sends it, and its target follows after a second without input", () => {
  const stage = new SimulatedStage(0, 60);
  const session = new SimulatedStage(0, 60);
  session.claim();
  stage.claim();
  const drawBoth = () => {
    session.draw();
    const first = 4 * LIMB_FIRST_JOINTS[0];
    stage.draw(session.pose.rotations.slice(first, first + 12));
  };
  for (let frame = 0; frame < 30; frame++) drawBoth();
  session.prediction.target.setTarget(0.2, -0.6, 0.3, session.now);
  stage.isBonded = true;
  for (let frame = 0; frame < 25; frame++) drawBoth();
  // the transition from the prediction is over
  for (let i = 0; i < 72; i++) expect(stage.pose.rotations[i]).toBeCloseTo(session.pose.rotations[i], 12);
  expect([...stage.prediction.target.value]).toEqual(TARGETS[0]);
  for (let frame = 0; frame < 60; frame++) drawBoth();
  const { value, hasFollowed } = stage.prediction.target;
  expect(hasFollowed).toBe(true);
  for (const axis of [0, 1, 2]) expect(value[axis]).toBeCloseTo([0.2, -0.6, 0.3][axis], 6);
  stage.isBonded = false;
  for (let frame = 0; frame < 40; frame++) drawBoth();
  expect(stage.maxSpeed).toBeLessThan(25);
});
