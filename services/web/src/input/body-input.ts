/**
 * Hands of a person before the camera, which hold the hands of the selected performer: as in a mirror if it faces the
 * audience, from behind if it shows its back. In both cases the hand on the right of the picture moves the performer's
 * hand on the right of the stage.
 */
import { limbNumber, performerOfLimb } from "../wire/limbs";
import type { HandReach, LimbController } from "./limb-controller";
import type { PerformerSelection } from "./performer-selection";

/** What is known of a hand: where it is, or `"hold"` while it is briefly not seen; null if it lets go. */
export type HandState = HandReach | "hold" | null;

/** Hands of the person. */
export interface BodyMessage {
  readonly left: HandState;
  readonly right: HandState;
}

/** Minimum time between attempts to claim a limb that another puppeteer held, in milliseconds. */
const CLAIM_RETRY_MS = 300;

export interface BodyActions {
  /** Claim a limb for the camera. Return false if it is not available; the user has been told why. */
  claim(limb: number): boolean;
  /** True if no puppeteer holds a limb. */
  isFree(limb: number): boolean;
  /** True if a performer faces the audience. */
  isFacing(performer: number): boolean;
  readonly selection: PerformerSelection;
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
    private readonly actions: BodyActions,
  ) {}

  /** Follow the hands. `now` is in milliseconds and never decreases. */
  handle(message: BodyMessage, now: number): void {
    const { selection } = this.actions;
    const { left, right } = this.#hands;
    for (const hand of [left, right]) {
      this.#updateHold(hand);
      if (hand.limb !== null && performerOfLimb(hand.limb) !== selection.performer) this.#release(hand);
    }
    // A performer that turns round keeps the hands that hold it.
    const held = left.limb ?? right.limb;
    const isCrossed =
      held === null
        ? this.actions.isFacing(selection.performer)
        : held === limbNumber(selection.performer, left.limb === null ? 0 : 1);
    this.#move(left, limbNumber(selection.performer, isCrossed ? 1 : 0), message.left, now);
    this.#move(right, limbNumber(selection.performer, isCrossed ? 0 : 1), message.right, now);
  }

  /** Forget the limbs that are held: those of another session. */
  forget(): void {
    for (const hand of [this.#hands.left, this.#hands.right]) hand.limb = null;
  }

  /** Release both hands; each must let go before it claims again. */
  releaseAll(): void {
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
      hand.needsRest = this.actions.isFree(hand.limb);
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
    if (hand.limb !== null) this.limbs.reach(limb, state);
  }

  #claim(hand: Hand, limb: number, now: number): void {
    const source = this.limbs.source(limb);
    // A limb that was granted on request is held as by a key.
    if (source !== null && !(source === "velocity" && hand.isContested)) return;
    const isTried = hand.isContested && source === null;
    if (isTried && (now - hand.triedAt < CLAIM_RETRY_MS || !this.actions.isFree(limb))) return;
    hand.triedAt = now;
    hand.isContested = !this.actions.claim(limb);
    if (!hand.isContested) hand.limb = limb;
  }

  #release(hand: Hand): void {
    if (hand.limb !== null && this.limbs.source(hand.limb) === "camera") this.limbs.release(hand.limb);
    hand.limb = null;
  }
}
