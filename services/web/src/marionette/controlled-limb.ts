/**
 * One limb between the stored motion and a puppeteer, from claim to return. Each frame the limb first observes the
 * motion (`observePose`), then, while it is controlled, its joints are solved (`solveJoints`). A position (3) is a
 * hand tip in the shoulder's frame in arm lengths, or a thigh angle, the first of three. Poses are 18 rotations,
 * joints 12 numbers. Python: `marionette/controlled_limb.py`.
 */

import type { Numbers } from "../motion/rotation";
import type { Figure } from "../motion/skeleton";
import { addScaled, distanceBetween, length } from "../motion/vector";
import { ArmBlend } from "./blend";
import type { HandMotion } from "./bond";
import {
  ARRIVAL_TOLERANCE,
  HAND_ACCELERATION,
  MAX_HAND_RETURN_ACCELERATION,
  MAX_REACH,
  MAX_TIP_DISTANCE,
  MIN_REACH,
  MIN_SOLVE_WEIGHT,
  THIGH_ACCELERATION,
} from "./constants";
import { Elbow, liftAngle } from "./elbow";
import { Follower } from "./follower";
import { DirectionAlignment, JointBlend, returnAcceleration } from "./handover";
import { ArmRig, LegRig } from "./limb-rig";
import { add, type Point, scaled } from "./point";

const ZERO_VELOCITY = new Float64Array(3);

/** Common part of hands and legs: the position in the motion and the moving limb. */
export abstract class ControlledLimb {
  protected readonly motionPosition = new Float64Array(3);
  protected readonly velocity = new Float64Array(3);
  protected follower: Follower | null = null;
  protected returnAcceleration: number | null = null;
  private hasPose = false;
  private readonly currentPosition = new Float64Array(3);
  private readonly previousPosition = new Float64Array(3);
  private readonly previousVelocity = new Float64Array(3);

  /** Shown position (3); live storage. */
  get position(): Float64Array {
    return this.follower ? this.follower.position : this.motionPosition;
  }

  /** Observe a pose of the motion, `seconds` after the last one. */
  observePose(rotations: Numbers, seconds: number): void {
    const { motionPosition: own, previousPosition: before, currentPosition: now, velocity } = this;
    this.placeInPose(now, rotations);
    before.set(this.hasPose ? own : now);
    this.previousVelocity.set(velocity);
    own.set(now);
    for (let i = 0; i < 3; i++) velocity[i] = seconds > 0 ? (own[i] - before[i]) / seconds : 0;
    this.hasPose = true;
  }

  /** Return to the motion at once and reset the state. */
  reset(): void {
    this.follower = null;
    this.returnAcceleration = null;
  }

  /** Start from another pose than the motion's, at rest. */
  startFrom(rotations: Numbers): void {
    this.placeInPose(this.currentPosition, rotations);
    this.follower = new Follower(this.currentPosition, ZERO_VELOCITY);
  }

  /**
   * Write the limb's joints, `seconds` after the last call, for the last observed pose. Returns false and writes
   * nothing once the limb is back. The limb moves towards `goal` (3), or back to the motion if that is null.
   * `weight` (0..1) is the weight of the solver's joints.
   */
  abstract solveJoints(
    out: Numbers,
    outAt: number,
    rotations: Numbers,
    goal: Numbers | null,
    weight: number,
    seconds: number,
  ): boolean;

  /** Write the position (3) of the limb in a pose. */
  abstract placeInPose(out: Numbers, rotations: Numbers): void;

  /** Return the follower, which starts with the position and velocity of the motion a frame ago. */
  protected ensureFollower(): Follower {
    return (this.follower ??= new Follower(this.previousPosition, this.previousVelocity));
  }

  /** Return the acceleration of the return, chosen once when the limb is released. */
  protected chooseReturnAcceleration(maxAcceleration: number): number {
    if (this.returnAcceleration !== null) return this.returnAcceleration;
    const { position, velocity } = this.ensureFollower();
    const distance = distanceBetween(position, 0, this.previousPosition, 0);
    return (this.returnAcceleration = returnAcceleration(
      distance,
      distanceBetween(velocity, 0, this.velocity, 0),
      maxAcceleration,
    ));
  }
}

/** One hand of a figure. */
export class ControlledHand extends ControlledLimb {
  readonly rig: ArmRig;
  private readonly elbow: Elbow;
  private readonly alignment = new DirectionAlignment();
  private readonly blend: ArmBlend;
  private readonly clampedGoal = new Float64Array(3);
  private readonly direction = new Float64Array(3);
  private readonly axis = new Float64Array(3);
  private readonly up = new Float64Array(3);
  private readonly target = new Float64Array(3);
  private readonly around = new Float64Array(4);
  private readonly jointPoints = new Float64Array(9);
  private readonly bent = new Float64Array(12);

  /** `limb` is 0 (left hand) or 1 (right hand), `table` the parsed bend table of the arm's proportions. */
  constructor(figure: Figure, limb: 0 | 1, table: Float64Array) {
    super();
    this.rig = new ArmRig(figure, limb, table);
    this.elbow = new Elbow(this.rig.arm, this.rig.shoulder);
    this.blend = new ArmBlend(this.rig);
  }

  override reset(): void {
    super.reset();
    this.elbow.reset();
    this.alignment.reset();
    this.blend.reset();
  }

  override solveJoints(
    out: Numbers,
    outAt: number,
    rotations: Numbers,
    goal: Numbers | null,
    weight: number,
    seconds: number,
  ): boolean {
    const { rig, motionPosition: own } = this;
    const { minTipDistance: inner } = rig.arm,
      follower = this.ensureFollower(),
      hand = follower.position;
    if (goal) {
      this.returnAcceleration = null;
      const reach = Math.min(Math.max(length(goal, 0), MIN_REACH), MAX_REACH);
      rig.targetDirection(this.clampedGoal, 0, goal, 0);
      for (let i = 0; i < 3; i++) this.clampedGoal[i] *= reach;
      follower.step(this.clampedGoal, seconds, HAND_ACCELERATION, inner, MAX_TIP_DISTANCE);
    } else {
      // the hand of the motion may be nearer to the shoulder than a controlled hand can be
      follower.step(
        own,
        seconds,
        this.chooseReturnAcceleration(MAX_HAND_RETURN_ACCELERATION),
        Math.min(inner, length(own, 0)),
        1,
        this.velocity,
      );
      if (weight <= 0 && distanceBetween(hand, 0, own, 0) < ARRIVAL_TOLERANCE) return false;
    }
    this.solveAt(out, outAt, rotations, hand, weight, seconds);
    return true;
  }

  /** Return where the hand is `seconds` after the last call of `solveJoints` if nothing moves it. */
  nextMotion(seconds: number): HandMotion {
    const { follower } = this;
    const velocity = pointOf(follower ? follower.velocity : this.velocity);
    if (!follower) return { place: pointOf(this.motionPosition), velocity };
    return { place: add(pointOf(follower.position), scaled(velocity, seconds)), velocity };
  }

  /** Return the place next to `place` that the arm reaches in the next `seconds`, within the shoulder's limit. */
  reachablePlace(rotations: Numbers, place: Point, seconds: number): Point {
    const { rig, direction, up, target } = this;
    this.beginElbow(rotations);
    target.set(place);
    rig.targetDirection(direction, 0, target, 0);
    rig.localUp(up, 0, rotations);
    return pointOf(this.elbow.preview(direction, length(target, 0), up, seconds).tip);
  }

  /** Write the arm's joints as `solveJoints` does, with the hand moved to the place that its bond gives. */
  solveBondedJoints(
    out: Numbers,
    outAt: number,
    rotations: Numbers,
    place: Point,
    weight: number,
    seconds: number,
  ): void {
    this.returnAcceleration = null;
    const follower = this.ensureFollower();
    follower.moveTo(place, seconds);
    this.solveAt(out, outAt, rotations, follower.position, weight, seconds);
  }

  private beginElbow(rotations: Numbers): void {
    const { rig, elbow, direction } = this;
    if (elbow.hasBegun) return;
    const at = 4 * rig.firstJointIndex;
    rig.jointPositions(this.jointPoints, 0, rotations, at);
    rig.targetDirection(direction, 0, this.motionPosition, 0);
    rig.planeNormal(this.axis, 0, rotations, at);
    elbow.begin(direction, this.axis, liftAngle(this.jointPoints, direction));
  }

  /** Write the arm's joints with the tip at `hand` (3), or next to it within the shoulder's limit. */
  private solveAt(
    out: Numbers,
    outAt: number,
    rotations: Numbers,
    hand: Numbers,
    weight: number,
    seconds: number,
  ): void {
    const { rig, elbow, motionPosition: own, direction, up, target, bent, around } = this;
    const at = 4 * rig.firstJointIndex;
    this.beginElbow(rotations);
    rig.targetDirection(direction, 0, hand, 0);
    rig.localUp(up, 0, rotations);
    const { tip, normal, bend } = elbow.step(direction, length(hand, 0), up, seconds);
    rig.bendJoints(bent, 0, length(tip, 0), bend);
    // the motion may hold an arm where the shoulder's limit forbids it: the limit comes in with the weight
    addScaled(target, 0, tip, 0, hand, 0, -1);
    addScaled(target, 0, hand, 0, target, 0, weight);
    this.alignment.update(around, 0, own, target, weight);
    this.blend.blend(
      out,
      outAt,
      rotations,
      at,
      bent,
      target,
      around,
      normal,
      Math.max(weight, MIN_SOLVE_WEIGHT),
      seconds,
    );
  }

  override placeInPose(out: Numbers, rotations: Numbers): void {
    this.rig.tipTarget(out, 0, rotations, 4 * this.rig.firstJointIndex);
  }
}

function pointOf(numbers: Numbers): Point {
  return [numbers[0], numbers[1], numbers[2]];
}

/** One leg of a figure. */
export class ControlledLeg extends ControlledLimb {
  readonly rig: LegRig;
  private readonly solved = new Float64Array(12);
  private readonly blend = new JointBlend();

  /** `limb` is 2 (left leg) or 3 (right leg). */
  constructor(figure: Figure, limb: 2 | 3) {
    super();
    this.rig = new LegRig(figure, limb);
  }

  override reset(): void {
    super.reset();
    this.blend.reset();
  }

  override solveJoints(
    out: Numbers,
    outAt: number,
    rotations: Numbers,
    goal: Numbers | null,
    weight: number,
    seconds: number,
  ): boolean {
    const { rig, motionPosition: own, solved } = this;
    const follower = this.ensureFollower(),
      thigh = follower.position;
    if (goal) {
      this.returnAcceleration = null;
      follower.step(goal, seconds, THIGH_ACCELERATION);
    } else {
      follower.step(own, seconds, this.chooseReturnAcceleration(THIGH_ACCELERATION), 0, Infinity, this.velocity);
      if (weight <= 0 && Math.abs(thigh[0] - own[0]) < ARRIVAL_TOLERANCE) return false;
    }
    rig.solve(solved, 0, thigh[0], rotations);
    this.blend.blend(out, outAt, rotations, 4 * rig.firstJointIndex, solved, 0, Math.max(weight, MIN_SOLVE_WEIGHT));
    return true;
  }

  override placeInPose(out: Numbers, rotations: Numbers): void {
    out[0] = this.rig.thighAngle(rotations, this.motionPosition[0]);
    out[1] = out[2] = 0;
  }
}
