/**
 * One limb between the dance and a hand: taken, pulled, let go. Each frame the limb is first shown the dance (`see`), then,
 * while it is not wholly the dance's, pulled (`pull`). It remembers where it is and how fast it goes, and is moved on by the time
 * between frames, in seconds. Places (3) are hand tips in the shoulder's frame in arm lengths; of a leg the thigh's angle, first
 * of three. Poses are 18 rotations, joints 12 numbers. As `marionette/pulled.py`.
 */

import type { Numbers } from "../motion/rotation";
import type { Figure } from "../motion/skeleton";
import { addScaled, apart, length } from "../motion/vector";
import { ArmBlend } from "./blend";
import { Elbow, liftBetween } from "./elbow";
import { Follower } from "./follow";
import { accelerationHome, HAND_ACCELERATION, JointMix, THIGH_ACCELERATION, Turn } from "./handover";
import { ArmRig, LegRig } from "./limbs";
import { OUTER_RADIUS } from "./proportions";

/** Arm lengths: a pulled arm is never quite locked, so that its elbow leaves the line at a bounded speed. */
export const MOST_REACH = 0.9995;
/** Arm lengths from the shoulder that a hand is pulled to at least: nearer in, the elbow would have to whirl. */
export const LEAST_REACH = 0.15;
/** Arm lengths per second squared, against the dance, that a hand let go comes back with at most. */
const HAND_HOME = 79;
/** Arm lengths, or radians, within which a limb is the dance's again. */
const ARRIVED = 1e-6;
/** A limb on its last way home is still solved for. */
const LEAST_WEIGHT = 1e-9;

const STILL = new Float64Array(3);

/** What hands and legs have in common: how the dance has the limb, and how it moves. */
export abstract class Pulled {
  protected readonly own = new Float64Array(3);
  protected readonly velocity = new Float64Array(3);
  protected follower: Follower | null = null;
  protected home: number | null = null;
  private seen = false;
  private readonly now = new Float64Array(3);
  private readonly before = new Float64Array(3);
  private readonly velocityBefore = new Float64Array(3);

  /** Where the limb is (3); live storage. */
  get place(): Float64Array {
    return this.follower ? this.follower.place : this.own;
  }

  /** The dance's pose, `seconds` after the last. */
  see(rotations: Numbers, seconds: number): void {
    const { own, before, now, velocity } = this;
    this.whereIn(now, rotations);
    before.set(this.seen ? own : now);
    this.velocityBefore.set(velocity);
    own.set(now);
    for (let i = 0; i < 3; i++) velocity[i] = seconds > 0 ? (own[i] - before[i]) / seconds : 0;
    this.seen = true;
  }

  /** The limb is wholly the dance's. */
  rest(): void {
    this.follower = null;
    this.home = null;
  }

  /** The limb is taken where another pose than the dance has it, standing. */
  startFrom(rotations: Numbers): void {
    this.whereIn(this.now, rotations);
    this.follower = new Follower(this.now, STILL);
  }

  /**
   * Writes the limb's joints, `seconds` after the last, in the pose that was seen just now; false, nothing written, once it is
   * back. It is on its way to `wanted` (3), or, where that is null, back to the dance; `weight` (0..1) says how far it has gone
   * over from the dance's way of reaching a place to the marionette's.
   */
  abstract pull(out: Numbers, outAt: number, rotations: Numbers, wanted: Numbers | null, weight: number, seconds: number): boolean;

  /** Where a pose has the limb (3). */
  protected abstract whereIn(out: Numbers, rotations: Numbers): void;

  /** What moves the limb; it starts from where the dance had it a frame ago, at the speed it had. */
  protected followed(): Follower {
    return (this.follower ??= new Follower(this.before, this.velocityBefore));
  }

  /** The acceleration on the way back to the dance, settled when the limb is let go. */
  protected homewards(most: number): number {
    if (this.home !== null) return this.home;
    const { place, velocity } = this.followed();
    const away = apart(place, 0, this.before, 0);
    return (this.home = accelerationHome(away, apart(velocity, 0, this.velocity, 0), most));
  }
}

/** One hand of a figure. */
export class PulledHand extends Pulled {
  readonly rig: ArmRig;
  private readonly elbow: Elbow;
  private readonly turn = new Turn();
  private readonly blend: ArmBlend;
  private readonly wanted = new Float64Array(3);
  private readonly direction = new Float64Array(3);
  private readonly axis = new Float64Array(3);
  private readonly up = new Float64Array(3);
  private readonly target = new Float64Array(3);
  private readonly around = new Float64Array(4);
  private readonly places = new Float64Array(9);
  private readonly bent = new Float64Array(12);

  /** `limb` is 0 (left hand) or 1 (right hand), `table` what `readTable` gave for the arm's proportions. */
  constructor(figure: Figure, limb: 0 | 1, table: Float64Array) {
    super();
    this.rig = new ArmRig(figure, limb, table);
    this.elbow = new Elbow(this.rig.arm, this.rig.shoulder);
    this.blend = new ArmBlend(this.rig);
  }

  override rest(): void {
    super.rest();
    this.elbow.forget();
    this.turn.rest();
    this.blend.forget();
  }

  override pull(
    out: Numbers, outAt: number, rotations: Numbers, wanted: Numbers | null, weight: number, seconds: number,
  ): boolean {
    const { rig, elbow, own, direction, up, target, bent, around } = this;
    const { inner } = rig.arm, at = 4 * rig.first, follower = this.followed(), hand = follower.place;
    if (wanted) {
      this.home = null;
      const reach = Math.min(Math.max(length(wanted, 0), LEAST_REACH), MOST_REACH);
      rig.direction(this.wanted, 0, wanted, 0);
      for (let i = 0; i < 3; i++) this.wanted[i] *= reach;
      follower.step(this.wanted, seconds, HAND_ACCELERATION, inner, OUTER_RADIUS);
    } else {
      // the dance may have its hand nearer to the shoulder than one is pulled
      follower.step(own, seconds, this.homewards(HAND_HOME), Math.min(inner, length(own, 0)), 1, this.velocity);
      if (weight <= 0 && apart(hand, 0, own, 0) < ARRIVED) return false;
    }
    if (!elbow.known) {
      rig.places(this.places, 0, rotations, at);
      rig.direction(direction, 0, own, 0);
      rig.bendAxis(this.axis, 0, rotations, at);
      elbow.begin(direction, this.axis, liftBetween(this.places, direction));
    }
    rig.direction(direction, 0, hand, 0);
    rig.up(up, 0, rotations);
    const { tip, normal, bend } = elbow.follow(direction, length(hand, 0), up, seconds);
    rig.bend(bent, 0, length(tip, 0), bend);
    // the dance may hold its arms where the marionette's shoulders do not go: what they allow comes in with the weight
    addScaled(target, 0, tip, 0, hand, 0, -1);
    addScaled(target, 0, hand, 0, target, 0, weight);
    this.turn.follow(around, 0, own, target, weight);
    this.blend.joints(out, outAt, rotations, at, bent, target, around, normal, Math.max(weight, LEAST_WEIGHT), seconds);
    return true;
  }

  protected override whereIn(out: Numbers, rotations: Numbers): void {
    this.rig.target(out, 0, rotations, 4 * this.rig.first);
  }
}

/** One leg of a figure. */
export class PulledLeg extends Pulled {
  readonly rig: LegRig;
  private readonly hung = new Float64Array(12);
  private readonly mix = new JointMix();

  /** `limb` is 2 (left leg) or 3 (right leg). */
  constructor(figure: Figure, limb: 2 | 3) {
    super();
    this.rig = new LegRig(figure, limb);
  }

  override rest(): void {
    super.rest();
    this.mix.rest();
  }

  override pull(
    out: Numbers, outAt: number, rotations: Numbers, wanted: Numbers | null, weight: number, seconds: number,
  ): boolean {
    const { rig, own, hung } = this;
    const follower = this.followed(), thigh = follower.place;
    if (wanted) {
      this.home = null;
      follower.step(wanted, seconds, THIGH_ACCELERATION);
    } else {
      follower.step(own, seconds, this.homewards(THIGH_ACCELERATION), 0, Infinity, this.velocity);
      if (weight <= 0 && Math.abs(thigh[0] - own[0]) < ARRIVED) return false;
    }
    rig.hang(hung, 0, thigh[0], rotations);
    this.mix.mix(out, outAt, rotations, 4 * rig.first, hung, 0, Math.max(weight, LEAST_WEIGHT));
    return true;
  }

  protected override whereIn(out: Numbers, rotations: Numbers): void {
    out[0] = this.rig.angle(rotations, this.own[0]);
    out[1] = out[2] = 0;
  }
}
