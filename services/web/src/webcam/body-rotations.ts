/**
 * Rotations of the figure's joints (`motion/skeleton.ts`) from the landmarks of a whole body, for a performer who is
 * captured by a camera. Pure.
 *
 * A bone points where its landmarks say. How it turns about itself follows from the next bone: elbow and knee are
 * hinges, so the plane of a bent limb is known; a straight limb turns as little as possible from its parent.
 */
import { conjugate, multiply, type Numbers, rotate } from "../motion/rotation";
import { JOINTS, PARENTS, restPose } from "../motion/skeleton";
import { addScaled, combine, cross, dot, fromColumns, rejectFrom, rotationBetween, unit } from "../motion/vector";
import { LANDMARK, LANDMARK_COUNT, LANDMARK_STRIDE, visibilityOf } from "./landmark";

/** Visibility that the landmarks of a joint need; with less, the joint keeps its last rotation. */
const MIN_VISIBILITY = 0.5;
/** Sines of the bend of elbow or knee from which and with which its plane is trusted. */
const [MIN_BEND_SINE, TRUSTED_BEND_SINE] = [0.12, 0.35];
/** Angle in radians by which the nose of a head that is held level is below the ears, as seen from between them. */
const NOSE_PITCH_RAD = 0.2;

const ROOT = JOINTS.indexOf("humanoid_root");
const CHEST = JOINTS.indexOf("vl5");
const HEAD = JOINTS.indexOf("skullbase");

const X_AXIS = Float64Array.of(1, 0, 0);
const DOWN = Float64Array.of(0, -1, 0);
const FORWARD = Float64Array.of(0, 0, 1);

/** Joints and landmarks of a limb. `hingeSign` is the sign of x about which its hinge bends. */
const LIMBS = (["left", "right"] as const).flatMap((side) => {
  const prefix = side === "left" ? "l" : "r";
  const joint = (name: string) => JOINTS.indexOf(`${prefix}_${name}`);
  return [
    {
      first: joint("shoulder"),
      landmarks: [LANDMARK[`${side}Shoulder`], LANDMARK[`${side}Elbow`], LANDMARK[`${side}Wrist`]],
      hingeSign: -1,
    },
    {
      first: joint("hip"),
      landmarks: [LANDMARK[`${side}Hip`], LANDMARK[`${side}Knee`], LANDMARK[`${side}Ankle`]],
      hingeSign: 1,
    },
  ] as const;
});

const HANDS = (["left", "right"] as const).map((side) => ({
  joint: JOINTS.indexOf(side === "left" ? "l_wrist" : "r_wrist"),
  wrist: LANDMARK[`${side}Wrist`],
  index: LANDMARK[`${side}Index`],
  pinky: LANDMARK[`${side}Pinky`],
}));

const FEET = (["left", "right"] as const).map((side) => ({
  joint: JOINTS.indexOf(side === "left" ? "l_ankle" : "r_ankle"),
  heel: LANDMARK[`${side}Heel`],
  toes: LANDMARK[`${side}Toes`],
}));

/** Conversion of the landmarks of successive pictures. It keeps the last rotation of joints that are not seen. */
export class BodyRotations {
  readonly #local = restPose().rotations;
  readonly #world = restPose().rotations;
  /** Positions in the figure's axes (99). */
  readonly #points = new Float64Array(LANDMARK_COUNT * 3);
  readonly #columns = new Float64Array(9);
  readonly #vectors = new Float64Array(12);
  readonly #turn = new Float64Array(4);

  /**
   * Return the local rotations w x y z of the 18 joints (72) for the world landmarks (132) of a picture. The result is
   * valid until the next call.
   */
  update(landmarks: Float64Array): Float64Array {
    const points = this.#points;
    for (let landmark = 0; landmark < LANDMARK_COUNT; landmark++) {
      // The person faces the camera, and the figure faces z: y and z change their signs.
      points[landmark * 3] = landmarks[landmark * LANDMARK_STRIDE];
      points[landmark * 3 + 1] = -landmarks[landmark * LANDMARK_STRIDE + 1];
      points[landmark * 3 + 2] = -landmarks[landmark * LANDMARK_STRIDE + 2];
    }
    const isSeen = (...needed: number[]) =>
      needed.every((landmark) => visibilityOf(landmarks, landmark) >= MIN_VISIBILITY);
    this.#turnTrunk(isSeen);
    this.#turnHead(isSeen);
    for (const { first, landmarks: chain, hingeSign } of LIMBS)
      this.#turnLimb(first, chain, hingeSign, isSeen(...chain));
    for (const hand of HANDS) this.#turnHand(hand, isSeen(hand.wrist, hand.index, hand.pinky));
    for (const foot of FEET) this.#turnFoot(foot, isSeen(foot.heel, foot.toes));
    return this.#local;
  }

  /** Turn pelvis and chest: x along the line of hips or shoulders, y as near to the spine as possible. */
  #turnTrunk(isSeen: (...needed: number[]) => boolean): void {
    const { leftHip, rightHip, leftShoulder, rightShoulder } = LANDMARK;
    const spine = this.#vectors;
    this.#midpoint(0, leftShoulder, rightShoulder);
    this.#midpoint(3, leftHip, rightHip);
    addScaled(spine, 0, spine, 0, spine, 3, -1);
    const hasHips = isSeen(leftHip, rightHip);
    const hasShoulders = isSeen(leftShoulder, rightShoulder);
    // Without hips the spine is upright.
    if (!hasHips) spine.set([0, 1, 0]);
    const set = (joint: number, left: number, right: number, isKnown: boolean) => {
      const columns = this.#columns;
      this.#subtract(columns, 0, left, right);
      if (isKnown && unit(columns, 0, columns, 0)) {
        rejectFrom(columns, 3, spine, 0, columns, 0);
        if (unit(columns, 3, columns, 3)) {
          cross(columns, 6, columns, 0, columns, 3);
          this.#setWorld(joint, columns);
          return;
        }
      }
      this.#keep(joint);
    };
    if (hasHips || !hasShoulders) set(ROOT, leftHip, rightHip, hasHips);
    else set(ROOT, leftShoulder, rightShoulder, hasShoulders);
    this.#keep(JOINTS.indexOf("sacroiliac"));
    set(CHEST, leftShoulder, rightShoulder, hasShoulders);
  }

  /** Turn the head: x from ear to ear, z to the nose. */
  #turnHead(isSeen: (...needed: number[]) => boolean): void {
    const { leftEar, rightEar, nose } = LANDMARK;
    const columns = this.#columns;
    const ahead = this.#vectors;
    this.#subtract(columns, 0, leftEar, rightEar);
    this.#midpoint(0, leftEar, rightEar);
    for (let i = 0; i < 3; i++) ahead[i] = this.#points[nose * 3 + i] - ahead[i];
    if (isSeen(leftEar, rightEar, nose) && unit(columns, 0, columns, 0)) {
      rejectFrom(ahead, 0, ahead, 0, columns, 0);
      if (unit(ahead, 0, ahead, 0)) {
        cross(ahead, 3, ahead, 0, columns, 0);
        // Up again by the angle of the nose.
        combine(columns, 6, ahead, 0, Math.cos(NOSE_PITCH_RAD), ahead, 3, Math.sin(NOSE_PITCH_RAD));
        cross(columns, 3, columns, 6, columns, 0);
        this.#setWorld(HEAD, columns);
        return;
      }
    }
    this.#keep(HEAD);
  }

  /** Turn the two bones of an arm or leg. */
  #turnLimb(first: number, [start, middle, end]: readonly number[], hingeSign: number, isKnown: boolean): void {
    const [upper, lower] = [0, 3];
    const v = this.#vectors;
    this.#subtract(v, upper, middle, start);
    this.#subtract(v, lower, end, middle);
    if (!isKnown || !unit(v, upper, v, upper) || !unit(v, lower, v, lower)) {
      this.#keep(first);
      this.#keep(first + 1);
      return;
    }
    this.#aim(first, v, upper, PARENTS[first]);
    // The axis of the hinge, as far as the limb is bent.
    const [hinge, side] = [6, 9];
    cross(v, hinge, v, upper, v, lower);
    const trust = smoothStep(Math.hypot(v[hinge], v[hinge + 1], v[hinge + 2]), MIN_BEND_SINE, TRUSTED_BEND_SINE);
    if (trust > 0 && unit(v, hinge, v, hinge)) {
      rotate(v, side, this.#world, first * 4, X_AXIS, 0);
      // A hinge that seems to bend backwards is noise: a straight limb.
      const share = trust * smoothStep(hingeSign * dot(v, hinge, v, side), -0.9, -0.5);
      const columns = this.#columns;
      combine(columns, 0, v, side, 1 - share, v, hinge, share * hingeSign);
      rejectFrom(columns, 0, columns, 0, v, upper);
      if (unit(columns, 0, columns, 0)) {
        for (let i = 0; i < 3; i++) columns[3 + i] = -v[upper + i];
        cross(columns, 6, columns, 0, columns, 3);
        this.#setWorld(first, columns);
      }
    }
    this.#aim(first + 1, v, lower, first);
  }

  /** Turn a hand: y from the knuckles to the wrist, z from the little finger to the index finger. */
  #turnHand({ joint, wrist, index, pinky }: (typeof HANDS)[number], isKnown: boolean): void {
    const columns = this.#columns;
    this.#midpoint(0, index, pinky);
    for (let i = 0; i < 3; i++) columns[3 + i] = this.#points[wrist * 3 + i] - this.#vectors[i];
    this.#subtract(columns, 6, index, pinky);
    if (isKnown && unit(columns, 3, columns, 3)) {
      rejectFrom(columns, 6, columns, 6, columns, 3);
      if (unit(columns, 6, columns, 6)) {
        cross(columns, 0, columns, 3, columns, 6);
        this.#setWorld(joint, columns);
        return;
      }
    }
    this.#keep(joint);
  }

  /** Turn a foot so that it points from heel to toes. */
  #turnFoot({ joint, heel, toes }: (typeof FEET)[number], isKnown: boolean): void {
    const v = this.#vectors;
    this.#subtract(v, 0, toes, heel);
    if (isKnown && unit(v, 0, v, 0)) this.#aim(joint, v, 0, PARENTS[joint], FORWARD);
    else this.#keep(joint);
  }

  /** Turn a joint by the smallest rotation from its parent that brings `bone` to the direction at `at`. */
  #aim(joint: number, direction: Numbers, at: number, parent: number, bone = DOWN): void {
    const local = new Float64Array(3);
    conjugate(this.#turn, 0, this.#world, parent * 4);
    rotate(local, 0, this.#turn, 0, direction, at);
    rotationBetween(this.#local, joint * 4, bone, 0, local, 0);
    multiply(this.#world, joint * 4, this.#world, parent * 4, this.#local, joint * 4);
  }

  /** Set the world orientation of a joint by its axes (9). */
  #setWorld(joint: number, columns: Numbers): void {
    fromColumns(this.#world, joint * 4, columns, 0);
    const parent = PARENTS[joint];
    if (parent < 0) {
      for (let i = 0; i < 4; i++) this.#local[joint * 4 + i] = this.#world[joint * 4 + i];
      return;
    }
    conjugate(this.#turn, 0, this.#world, parent * 4);
    multiply(this.#local, joint * 4, this.#turn, 0, this.#world, joint * 4);
  }

  /** Keep the local rotation of a joint. */
  #keep(joint: number): void {
    const parent = PARENTS[joint];
    if (parent < 0) for (let i = 0; i < 4; i++) this.#world[joint * 4 + i] = this.#local[joint * 4 + i];
    else multiply(this.#world, joint * 4, this.#world, parent * 4, this.#local, joint * 4);
  }

  #subtract(out: Numbers, outAt: number, to: number, from: number): void {
    addScaled(out, outAt, this.#points, to * 3, this.#points, from * 3, -1);
  }

  #midpoint(outAt: number, a: number, b: number): void {
    combine(this.#vectors, outAt, this.#points, a * 3, 0.5, this.#points, b * 3, 0.5);
  }
}

/** Return 0 below `from`, 1 above `to`, and a smooth step between. */
function smoothStep(value: number, from: number, to: number): number {
  const share = Math.min(1, Math.max(0, (value - from) / (to - from)));
  return share * share * (3 - 2 * share);
}
