/**
 * Limbs of a figure: from a target to the local rotations of three joints, and back. The target of a hand is its
 * tip in the shoulder's frame (axes of vl5), in arm lengths; the target of a leg is the thigh's angle from
 * straight down in the vertical plane that the hips face. Gravity is the world's. Only `shoulderFrame` allocates.
 * Python: `marionette/limb_rig.py`.
 */

import { conjugate, multiply, type Numbers, rotate } from "../motion/rotation";
import type { Figure, Pose } from "../motion/skeleton";
import {
  anyPerpendicular,
  combine,
  cross,
  dot,
  fromColumns,
  fromCoordinateAxis,
  length,
  normalise,
  rejectFrom,
  setVector,
  unit,
} from "../motion/vector";
import { Arm } from "./arm";
import { MAX_WRIST_BEND_RAD } from "./constants";
import { elevation, verticalNormal } from "./elbow";
import { clampThigh, kneeBend } from "./leg";
import type { Point } from "./point";
import { type Proportions, proportionsFromLinks } from "./proportions";
import { ShoulderLimit } from "./shoulder";

const SACROILIAC_INDEX = 1;
const VL5_INDEX = 10;
const FIRST_JOINT_INDICES = [12, 15, 2, 6] as const;
const X = Float64Array.of(1, 0, 0);
const UP = Float64Array.of(0, 1, 0);
const FORWARDS = Float64Array.of(0, 0, 1);
/** At rest, a rotation about this axis lifts the lower end of an elbow or a thigh forwards. */
const BEND_AXIS = Float64Array.of(-1, 0, 0);

/** Write the orientation (4) with x along the bone and z the part of the bend axis perpendicular to it. */
function boneFrame(out: Numbers, outAt: number, bone: Numbers, boneAt: number): void {
  const columns = new Float64Array(9);
  if (!unit(columns, 0, bone, boneAt)) setVector(columns, 0, 0, -1, 0);
  rejectFrom(columns, 6, BEND_AXIS, 0, columns, 0);
  if (!unit(columns, 6, columns, 6)) anyPerpendicular(columns, 6, columns, 0);
  cross(columns, 3, columns, 6, columns, 0);
  fromColumns(out, outAt, columns, 0);
}

/** Return the bones (9) of an arm at rest: upper arm, forearm, hand. */
function armBones(figure: Figure, limb: 0 | 1): Float64Array {
  const shoulder = FIRST_JOINT_INDICES[limb];
  const links = new Float64Array(9);
  links.set(figure.offsets.subarray(3 * shoulder + 3, 3 * shoulder + 9), 0);
  links.set(figure.tips.subarray(3 * shoulder + 6, 3 * shoulder + 9), 6);
  return links;
}

/** Return the proportions of a figure's arm (limb 0 or 1); their identity names its bend table. */
export function armProportions(figure: Figure, limb: 0 | 1): Proportions {
  const links = armBones(figure, limb);
  return proportionsFromLinks(length(links, 0), length(links, 3), length(links, 6));
}

/** One arm of a figure. Joints are twelve numbers: the local rotations of shoulder, elbow and wrist. */
export class ArmRig {
  /** Index of the first joint, the shoulder; elbow and wrist follow it. */
  readonly firstJointIndex: number;
  /** The arm's length in metres, and its three bones at rest (9). */
  readonly armLengthM: number;
  readonly bones: Float64Array;
  readonly arm: Arm;
  readonly shoulder: ShoulderLimit;
  private readonly restFrames = new Float64Array(12);
  private readonly palmTurnRad: number;
  /** Offsets (3) at rest, metres: of vl5 from the root, and of the shoulder from vl5. */
  private readonly trunk: Float64Array;
  private readonly shoulderOffset: Float64Array;
  private readonly angles = new Float64Array(3);
  private readonly columns = new Float64Array(9);
  private readonly turn = new Float64Array(4);
  private readonly palm = new Float64Array(4);
  private readonly scratch = new Float64Array(3);
  private readonly found = new Float64Array(9);

  /** `limb` is 0 (left hand) or 1 (right hand), `table` the bend table of `armProportions(figure, limb)`. */
  constructor(figure: Figure, limb: 0 | 1, table: Float64Array) {
    this.firstJointIndex = FIRST_JOINT_INDICES[limb];
    this.bones = armBones(figure, limb);
    this.armLengthM = length(this.bones, 0) + length(this.bones, 3) + length(this.bones, 6);
    this.arm = new Arm(armProportions(figure, limb), table);
    this.shoulder = new ShoulderLimit(limb === 1);
    for (let link = 0; link < 3; link++) boneFrame(this.restFrames, 4 * link, this.bones, 3 * link);
    this.palmTurnRad = limb === 0 ? Math.PI / 2 : -Math.PI / 2;
    this.trunk = figure.offsets.slice(3 * VL5_INDEX, 3 * VL5_INDEX + 3);
    this.shoulderOffset = figure.offsets.slice(3 * this.firstJointIndex, 3 * this.firstJointIndex + 3);
  }

  /** Write the world's up (3) in the shoulder's frame, for a pose's 18 rotations. */
  localUp(out: Numbers, outAt: number, rotations: Numbers): void {
    multiply(this.turn, 0, rotations, 0, rotations, 4 * VL5_INDEX);
    conjugate(this.turn, 0, this.turn, 0);
    rotate(out, outAt, this.turn, 0, UP, 0);
  }

  /** Return position (metres) and orientation (4) of the shoulder's frame in a pose. */
  shoulderFrame({ root, rotations }: Pose): { position: Point; rotation: Float64Array } {
    const rotation = new Float64Array(4),
      trunk = new Float64Array(3),
      offset = new Float64Array(3);
    rotate(trunk, 0, rotations, 0, this.trunk, 0);
    multiply(rotation, 0, rotations, 0, rotations, 4 * VL5_INDEX);
    rotate(offset, 0, rotation, 0, this.shoulderOffset, 0);
    const at = (axis: number) => root[axis] + trunk[axis] + offset[axis];
    return { position: [at(0), at(1), at(2)], rotation };
  }

  /** Write elbow, wrist and tip (9) relative to the shoulder, in metres on the axes of vl5. */
  jointPositions(out: Numbers, outAt: number, joints: Numbers, jointsAt: number): void {
    const { turn, scratch, bones: links } = this;
    for (let link = 0; link < 3; link++) {
      const at = outAt + 3 * link;
      if (link === 0) for (let i = 0; i < 4; i++) turn[i] = joints[jointsAt + i];
      else multiply(turn, 0, turn, 0, joints, jointsAt + 4 * link);
      rotate(scratch, 0, turn, 0, links, 3 * link);
      for (let i = 0; i < 3; i++) out[at + i] = link === 0 ? scratch[i] : out[at - 3 + i] + scratch[i];
    }
  }

  /** Write the position (3) of the hand tip in arm lengths, which is the target for these joints. */
  tipTarget(out: Numbers, outAt: number, joints: Numbers, jointsAt: number): void {
    const { found, armLengthM: scale } = this;
    this.jointPositions(found, 0, joints, jointsAt);
    setVector(out, outAt, found[6] / scale, found[7] / scale, found[8] / scale);
  }

  /**
   * Write the normal (3) of the arm's plane, not of unit length: from its bend, or from the elbow's axis for a
   * straight arm.
   */
  planeNormal(out: Numbers, outAt: number, joints: Numbers, jointsAt: number): void {
    const { found, scratch, armLengthM: scale } = this;
    this.jointPositions(found, 0, joints, jointsAt);
    cross(found, 0, found, 0, found, 6);
    rotate(scratch, 0, joints, jointsAt, BEND_AXIS, 0);
    combine(out, outAt, found, 0, 1 / (scale * scale), scratch, 0, 0.1);
  }

  /** Write the unit vector (3) to a target; straight down for the shoulder itself. */
  targetDirection(out: Numbers, outAt: number, target: Numbers, targetAt: number): void {
    if (!unit(out, outAt, target, targetAt)) setVector(out, outAt, 0, -1, 0);
  }

  /** Write the frame (4) with x the unit `direction` to the tip and z the unit `normal`, perpendicular to it. */
  chordFrame(out: Numbers, outAt: number, direction: Numbers, normal: Numbers): void {
    const { columns } = this;
    columns.set(direction, 0);
    columns.set(normal, 6);
    cross(columns, 3, normal, 0, direction, 0);
    fromColumns(out, outAt, columns, 0);
  }

  /**
   * Write the joints with the tip at distance `reach` (arm lengths) and the wrist bent by `bend` radians. The
   * first is relative to the frame of the chord: that frame times it is the shoulder's rotation.
   */
  bendJoints(out: Numbers, outAt: number, reach: number, bend: number): void {
    const { restFrames: frames, angles, turn, palm } = this;
    this.arm.closeChain(angles, 0, reach, 0, bend);
    // the palm turns down as the wrist bends, because a wrist bends little to the side
    const share = (angles[2] - angles[1]) / MAX_WRIST_BEND_RAD;
    fromCoordinateAxis(palm, 0, 0, this.palmTurnRad * share * share * (3 - 2 * share));
    const shoulder = outAt,
      elbow = outAt + 4,
      wrist = outAt + 8;
    fromCoordinateAxis(out, shoulder, 2, angles[0]);
    conjugate(turn, 0, frames, 0);
    multiply(out, shoulder, out, shoulder, turn, 0);
    fromCoordinateAxis(turn, 0, 2, angles[1] - angles[0]);
    multiply(out, elbow, frames, 0, turn, 0);
    multiply(out, elbow, out, elbow, palm, 0);
    conjugate(turn, 0, frames, 4);
    multiply(out, elbow, out, elbow, turn, 0);
    conjugate(turn, 0, palm, 0);
    multiply(out, wrist, frames, 4, turn, 0);
    fromCoordinateAxis(turn, 0, 2, angles[2] - angles[1]);
    multiply(out, wrist, out, wrist, turn, 0);
    multiply(out, wrist, out, wrist, palm, 0);
    conjugate(turn, 0, frames, 8);
    multiply(out, wrist, out, wrist, turn, 0);
    normalise(out, elbow);
    normalise(out, wrist);
  }

  /**
   * Write the joints with the tip at `target` (3), bent by gravity alone in the plane of `normal`. By default this
   * is the vertical plane; straight above and below the shoulder it faces forwards.
   *
   * `up` is the world's up and `normal` the axis of the elbow's bend, unit vectors (3) on the axes of vl5. A
   * target out of reach is moved into reach along its direction.
   */
  solve(out: Numbers, outAt: number, target: Numbers, up: Numbers, normal: Numbers | null = null): void {
    const { turn } = this;
    const direction = new Float64Array(3),
      plane = new Float64Array(3);
    this.targetDirection(direction, 0, target, 0);
    if (normal) plane.set(normal);
    else if (!verticalNormal(plane, direction, up)) {
      rejectFrom(plane, 0, FORWARDS, 0, up, 0);
      if (!unit(plane, 0, plane, 0)) plane.set(UP);
      cross(plane, 0, plane, 0, up, 0);
      rejectFrom(plane, 0, plane, 0, direction, 0);
      if (!unit(plane, 0, plane, 0)) anyPerpendicular(plane, 0, direction, 0);
    }
    const reach = this.arm.clampDistance(length(target, 0));
    this.bendJoints(out, outAt, reach, this.arm.gravityBend(reach, elevation(direction, up)));
    this.chordFrame(turn, 0, direction, plane);
    multiply(out, outAt, turn, 0, out, outAt);
    normalise(out, outAt);
  }
}

/** One leg of a figure. */
export class LegRig {
  /** Index of the first joint, the hip; knee and ankle follow it. */
  readonly firstJointIndex: number;
  private readonly thigh: Float64Array;
  private readonly thighFrame = new Float64Array(4);
  private readonly shankFrame = new Float64Array(4);
  private readonly ankle = new Float64Array(4);
  private readonly hips = new Float64Array(4);
  private readonly columns = new Float64Array(9);
  private readonly turn = new Float64Array(4);
  private readonly scratch = new Float64Array(3);

  /** `limb` is 2 (left leg) or 3 (right leg). */
  constructor(figure: Figure, limb: 2 | 3) {
    this.firstJointIndex = FIRST_JOINT_INDICES[limb];
    this.thigh = figure.offsets.slice(3 * this.firstJointIndex + 3, 3 * this.firstJointIndex + 6);
    boneFrame(this.thighFrame, 0, this.thigh, 0);
    boneFrame(this.shankFrame, 0, figure.offsets, 3 * this.firstJointIndex + 6);
    // the ankle is fixed as in standing: the foot is level when the shank is vertical
    fromColumns(this.turn, 0, Float64Array.of(0, -1, 0, 0, 0, 1, -1, 0, 0), 0);
    conjugate(this.turn, 0, this.turn, 0);
    multiply(this.ankle, 0, this.shankFrame, 0, this.turn, 0);
    normalise(this.ankle, 0);
  }

  /**
   * Compute the world orientation of the hips, and in `columns` the horizontal direction that they face, up, and
   * their product.
   */
  private computeHipFacing(rotations: Numbers): void {
    const { hips, columns, scratch } = this;
    multiply(hips, 0, rotations, 0, rotations, 4 * SACROILIAC_INDEX);
    rotate(scratch, 0, hips, 0, X, 0);
    cross(columns, 0, scratch, 0, UP, 0);
    rotate(scratch, 0, hips, 0, FORWARDS, 0);
    setVector(columns, 0, columns[0] + 0.05 * scratch[0], 0, columns[2] + 0.05 * scratch[2]);
    if (!unit(columns, 0, columns, 0)) columns.set(FORWARDS, 0);
    columns.set(UP, 3);
    cross(columns, 6, columns, 0, UP, 0);
  }

  /**
   * Return the thigh's angle in a pose (18 rotations), within its limits. A thigh beyond them is at the limit that
   * is nearer to `referenceAngle`, radians.
   */
  thighAngle(rotations: Numbers, referenceAngle = 0): number {
    this.computeHipFacing(rotations);
    multiply(this.turn, 0, this.hips, 0, rotations, 4 * this.firstJointIndex);
    rotate(this.scratch, 0, this.turn, 0, this.thigh, 0);
    const theta = Math.atan2(dot(this.scratch, 0, this.columns, 0), -this.scratch[1]);
    return clampThigh(theta + 2 * Math.PI * Math.round((referenceAngle - theta) / (2 * Math.PI)));
  }

  /** Write the rotations of hip, knee and ankle (12) with the thigh at `theta` radians and the shank hanging. */
  solve(out: Numbers, outAt: number, theta: number, rotations: Numbers): void {
    const { turn } = this;
    this.computeHipFacing(rotations);
    const lifted = clampThigh(theta);
    fromColumns(out, outAt, this.columns, 0);
    conjugate(turn, 0, this.hips, 0);
    multiply(out, outAt, turn, 0, out, outAt);
    fromCoordinateAxis(turn, 0, 2, lifted - Math.PI / 2);
    multiply(out, outAt, out, outAt, turn, 0);
    conjugate(turn, 0, this.thighFrame, 0);
    multiply(out, outAt, out, outAt, turn, 0);
    fromCoordinateAxis(turn, 0, 2, -kneeBend(lifted));
    multiply(out, outAt + 4, this.thighFrame, 0, turn, 0);
    conjugate(turn, 0, this.shankFrame, 0);
    multiply(out, outAt + 4, out, outAt + 4, turn, 0);
    normalise(out, outAt);
    normalise(out, outAt + 4);
    out.set(this.ankle, outAt + 8);
  }
}
