import { describe, expect, test } from "vitest";
import { createMarionetteSolver } from "../../src/client/marionette-solver";
import { PredictedLimb } from "../../src/client/predicted-limb";
import { fromRotationVector } from "../../src/motion/rotation";
import { copyPose, LIMB_FIRST_JOINTS, type Pose, restPose } from "../../src/motion/skeleton";
import { figure, rotationAngle, table } from "../marionette/figure";

const ASKED = [
  [0.4, -0.3, 0.5],
  [-0.4, -0.3, 0.5],
  [0.9, 0, 0],
  [0.9, 0, 0],
];

/** A dance that swings at 0.7 Hz about every axis of every joint, the elbows bent between 0.5 and 1.1 rad. */
function motionPose(seconds: number): Pose {
  const pose = restPose();
  for (let joint = 0; joint < 18; joint++) {
    const [x, y, z] = [0, 1, 2].map((axis) => 0.3 * Math.sin(4.4 * seconds + joint + 2 * axis));
    fromRotationVector(pose.rotations, 4 * joint, joint === 13 || joint === 16 ? x - 0.8 : x, y, z);
  }
  return pose;
}

/** One limb over a dance, drawn frame by frame; `others` is what everyone sees of its joints where it is pulled. */
class SimulatedStage {
  readonly own: PredictedLimb;
  readonly solver = createMarionetteSolver(figure, [table, table]);
  pose = restPose();
  dance = restPose();
  now = 0;
  /** The greatest turn of a joint against the dance from one frame to the next, radians a second. */
  fastest = 0;
  theirs = false;

  constructor(
    readonly limb: number,
    readonly fps: number,
  ) {
    this.own = new PredictedLimb(limb);
  }

  draw(others: Float64Array | null = null): void {
    const { dance, pose, limb, fps } = this;
    this.now += 1000 / fps;
    this.dance = motionPose(this.now / 1000);
    this.pose = restPose();
    copyPose(this.dance, this.pose);
    const first = 4 * LIMB_FIRST_JOINTS[limb];
    if (others) this.pose.rotations.set(others, first);
    this.own.apply(this.pose, this.dance, others !== null, this.theirs, this.now, this.solver);
    for (let joint = 0; joint < 72; joint += 4) {
      const swung = rotationAngle(this.dance.rotations, joint, dance.rotations, joint);
      const step = rotationAngle(this.pose.rotations, joint, pose.rotations, joint);
      if (joint < first || joint >= first + 12) {
        expect(this.pose.rotations.slice(joint, joint + 4)).toEqual(this.dance.rotations.slice(joint, joint + 4));
      }
      if (this.now > 2000 / fps) this.fastest = Math.max(this.fastest, (step - swung) * fps);
    }
  }

  take(): void {
    const [x, y, z] = ASKED[this.limb];
    this.own.target.take(this.now);
    this.own.target.setTarget(x, y, z, this.now);
  }

  /** Whether the limb is drawn as the dance has it. */
  isDance(): boolean {
    return [0, 4, 8].every((at) => {
      const joint = 4 * LIMB_FIRST_JOINTS[this.limb] + at;
      return rotationAngle(this.pose.rotations, joint, this.dance.rotations, joint) < 1e-9;
    });
  }
}

const limbs = [0, 1, 2, 3].flatMap((limb) => [20, 60, 144].map((fps) => [limb, fps] as const));
/** No joint turns faster than this against the dance, radians a second. */
const BOUND = 45;

test("a limb that nobody holds is left alone", () => {
  const stage = new SimulatedStage(0, 60);
  for (let frame = 0; frame < 10; frame++) {
    stage.draw();
    expect(stage.pose).toEqual(stage.dance);
  }
});

describe("in one's own hands", () => {
  test.each(limbs)(
    "limb %i at %i frames a second is taken, is where it should be, and comes back smoothly",
    (limb, fps) => {
      const stage = new SimulatedStage(limb, fps);
      for (let frame = 0; frame < fps / 2; frame++) stage.draw();
      expect(stage.isDance()).toBe(true);
      stage.take();
      for (let frame = 0; frame < fps; frame++) stage.draw();
      const puppet = createMarionetteSolver(figure, [table, table]).limbs[limb];
      puppet.observePose(stage.pose.rotations, 0);
      ASKED[limb].forEach((value, axis) => expect(puppet.position[axis]).toBeCloseTo(value, 6));
      stage.own.target.release();
      for (let frame = 0; frame < fps; frame++) stage.draw();
      expect(stage.isDance()).toBe(true);
      expect(stage.fastest).toBeLessThan(BOUND);
    },
  );

  test("what everyone sees of its way home, later, is not shown again", () => {
    const stage = new SimulatedStage(0, 60),
      held: Float64Array[] = [];
    stage.draw();
    stage.take();
    for (let frame = 0; frame < 60; frame++) {
      stage.draw();
      held.push(stage.pose.rotations.slice(48, 60));
    }
    stage.own.target.release();
    for (let frame = 0; frame < 42; frame++) {
      stage.draw(held[59]);
      held.push(stage.pose.rotations.slice(48, 60));
    }
    expect(stage.isDance()).toBe(true);
    // everyone's comes home later
    for (const joints of held.slice(60, 90)) {
      stage.draw(joints);
      expect(stage.isDance()).toBe(true);
    }
  });

  test("an everyone's view that stays pulled for over a second is let in smoothly", () => {
    const stage = new SimulatedStage(0, 60),
      joints = new Float64Array(12).fill(0);
    joints[0] = joints[4] = joints[8] = 1;
    stage.draw();
    stage.take();
    for (let frame = 0; frame < 30; frame++) stage.draw();
    stage.own.target.release();
    for (let frame = 0; frame < 150; frame++) stage.draw(joints);
    joints.forEach((value, i) => expect(stage.pose.rotations[48 + i]).toBeCloseTo(value, 9));
    expect(stage.fastest).toBeLessThan(BOUND);
  });
});

describe("in another's hands", () => {
  const others = new Float64Array(12);
  fromRotationVector(others, 0, -1.2, 0.3, 0.2);
  fromRotationVector(others, 4, -0.6, 0, 0.1);
  fromRotationVector(others, 8, 0.2, 0, 0);

  test.each(limbs)("limb %i at %i frames a second is what everyone sees, and goes over without a jump", (limb, fps) => {
    const stage = new SimulatedStage(limb, fps);
    stage.draw(others);
    stage.take();
    for (let frame = 0; frame < fps / 2; frame++) stage.draw(others);
    stage.theirs = true;
    for (let frame = 0; frame < fps / 2; frame++) stage.draw(others);
    others.forEach((value, i) => expect(stage.pose.rotations[4 * LIMB_FIRST_JOINTS[limb] + i]).toBeCloseTo(value, 9));
    stage.theirs = false;
    for (let frame = 0; frame < fps; frame++) stage.draw(others);
    const puppet = createMarionetteSolver(figure, [table, table]).limbs[limb];
    puppet.observePose(stage.pose.rotations, 0);
    ASKED[limb].forEach((value, axis) => expect(puppet.position[axis]).toBeCloseTo(value, 6));
    expect(stage.fastest).toBeLessThan(BOUND);
  });

  test("a hand that is taken on its way home from them starts where everyone sees it", () => {
    const stage = new SimulatedStage(0, 60);
    for (let frame = 0; frame < 10; frame++) stage.draw(others);
    const before = createMarionetteSolver(figure, [table, table]).limbs[0],
      after = createMarionetteSolver(figure, [table, table]).limbs[0];
    before.observePose(stage.pose.rotations, 0);
    stage.own.target.take(stage.now);
    for (let frame = 0; frame < 60; frame++) stage.draw(others);
    after.observePose(stage.pose.rotations, 0);
    [0, 1, 2].forEach((axis) => expect(Math.abs(after.position[axis] - before.position[axis])).toBeLessThan(0.02));
  });
});
