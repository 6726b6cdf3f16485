/**
 * Hands of a person before the camera, which hold the hands of the selected performer: as in a mirror if it faces the
 * audience, from behind if it shows its back. In both cases the hand on the right of the picture moves the performer's
 * hand on the right of the stage.
 */
import { Vector3 } from "three";
import type { Performer } from "../stage/puppet/performer";
import type { Stage } from "../stage/stage";
import { limbNumber, limbWithinPerformer, performerOfLimb } from "../wire/limbs";
import type { HoldSource, LimbController } from "./limb-controller";
import type { PerformerSelection } from "./performer-selection";
import { orientationOf, positionOf } from "./target-frame";

/**
 * Position of a hand relative to its shoulder, in lengths of the arm from shoulder to wrist: away from the body's
 * middle, up, and forwards.
 */
export type HandReach = readonly [outwards: number, up: number, forwards: number];

/** What is known of a hand: where it is, or `"hold"` while it is briefly not seen; null if it lets go. */
export type HandState = HandReach | "hold" | null;

/** Hands of the person. */
export interface BodyMessage {
  readonly left: HandState;
  readonly right: HandState;
}

/** Minimum time between attempts to claim a limb that another puppeteer held, in milliseconds. */
const CLAIM_RETRY_MS = 300;

/** Claims of limbs by this page. */
export interface LimbClaims {
  /** Claim a limb. Return false if it is not available; the user has been told why. */
  claim(limb: number, source: HoldSource): boolean;
  /** True if no puppeteer holds a limb, or it is open to the crowd. */
  canPull(limb: number): boolean;
  readonly selectedPerformer: PerformerSelection;
}

class Hand {
  /** Limb that the hand holds; null for none. */
  limb: number | null = null;
  /** True if the limb was released otherwise: the hand must let go before the next claim. */
  needsRest = false;
  /** True if the limb was claimed in vain: it is taken when it becomes free, or is granted. */
  isContested = false;
  triedAt = -Infinity;
}

export class BodyInput {
  readonly #hands = { left: new Hand(), right: new Hand() };

  constructor(
    private readonly limbs: LimbController,
    private readonly claims: LimbClaims,
    private readonly stage: Pick<Stage, "performers" | "back">,
  ) {}

  /**
   * Follow the hands. With null, release both; each must let go before it claims again. `now` is in milliseconds and
   * never decreases.
   */
  handle(message: BodyMessage | null, now: number): void {
    if (!message) {
      this.#releaseAll();
      return;
    }
    const selection = this.claims.selectedPerformer;
    const { left, right } = this.#hands;
    for (const hand of [left, right]) {
      this.#updateHold(hand);
      if (hand.limb !== null && performerOfLimb(hand.limb) !== selection.performer) this.#release(hand);
    }
    // A performer that turns round keeps the hands that hold it.
    const held = left.limb ?? right.limb;
    const isCrossed =
      held === null
        ? this.#isFacing(selection.performer)
        : held === limbNumber(selection.performer, left.limb === null ? 0 : 1);
    this.#move(left, limbNumber(selection.performer, isCrossed ? 1 : 0), message.left, now);
    this.#move(right, limbNumber(selection.performer, isCrossed ? 0 : 1), message.right, now);
  }

  #releaseAll(): void {
    for (const hand of [this.#hands.left, this.#hands.right]) {
      this.#updateHold(hand);
      if (hand.limb === null) continue;
      this.#release(hand);
      hand.needsRest = true;
    }
  }

  /** Notice that the session, or another input of this page, has taken the limb. */
  #updateHold(hand: Hand): void {
    if (hand.limb === null || this.limbs.source(hand.limb) === "camera") return;
    if (this.limbs.source(hand.limb) === null) {
      hand.needsRest = this.claims.canPull(hand.limb);
      hand.isContested = !hand.needsRest;
    }
    hand.limb = null;
  }

  #move(hand: Hand, limb: number, state: HandState, now: number): void {
    if (state === null || hand.limb !== limb) this.#release(hand);
    if (state === null) {
      hand.needsRest = hand.isContested = false;
      return;
    }
    if (state === "hold") return;
    if (hand.limb === null && !hand.needsRest) this.#claim(hand, limb, now);
    if (hand.limb !== null) this.#reach(limb, state);
  }

  /** Bring a hand where the person's hand is relative to the shoulder. */
  #reach(limb: number, [outwards, up, forwards]: HandReach): void {
    const performer = this.stage.performers[performerOfLimb(limb)];
    if (!performer) return;
    const isLeft = limbWithinPerformer(limb) === 0;
    const side = isLeft ? "l" : "r";
    const shoulder = positionOf(performer.joint(`${side}_shoulder`));
    const handle = new Vector3(isLeft ? outwards : -outwards, up, forwards)
      .multiplyScalar(measureArm(performer, side))
      .applyQuaternion(orientationOf(performer.joint("vl5")))
      .add(shoulder);
    this.limbs.pullHand(limb, handle);
  }

  /** Return whether a performer's chest faces the audience rather than its back. */
  #isFacing(performer: number): boolean {
    const { stage } = this;
    const chest = stage.performers[performer]?.joint("vl5");
    return !chest || new Vector3().setFromMatrixColumn(chest, 2).dot(stage.back()) >= 0;
  }

  #claim(hand: Hand, limb: number, now: number): void {
    const source = this.limbs.source(limb);
    // A limb that was granted on request is held as by a key.
    if (source !== null && !(source === "velocity" && hand.isContested)) return;
    const isTried = hand.isContested && source === null;
    if (isTried && (now - hand.triedAt < CLAIM_RETRY_MS || !this.claims.canPull(limb))) return;
    hand.triedAt = now;
    hand.isContested = !this.claims.claim(limb, "camera");
    if (!hand.isContested) hand.limb = limb;
  }

  #release(hand: Hand): void {
    if (hand.limb !== null && this.limbs.source(hand.limb) === "camera") this.limbs.release(hand.limb);
    hand.limb = null;
  }
}

/** Return the length of the streamed figure's arm from shoulder to wrist, in metres. */
function measureArm({ joint }: Performer, side: string): number {
  const [shoulder, elbow, wrist] = ["shoulder", "elbow", "wrist"].map((name) => positionOf(joint(`${side}_${name}`)));
  return shoulder.distanceTo(elbow) + elbow.distanceTo(wrist);
}
