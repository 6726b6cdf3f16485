/** State of one limb at a puppeteer: claim, request to its holder, and unsent input. Times are local milliseconds. */

import { INPUT_TARGET, INPUT_VELOCITY, type Input } from "../wire/messages";
import { PredictedLimb } from "./predicted-limb";

/** Minimum interval between inputs of a limb: the newest one replaces those before it. */
export const INPUT_INTERVAL_MS = 16;
/** Interval of keep-alive messages for a limb that is held still. */
const ALIVE_INTERVAL_MS = 100;
/** Time after which a request for a limb expires (proto/server.md, 6.3). */
const ASK_TIMEOUT_MS = 20_000;

/** "claimed": not answered by the session yet. "granted": held under an epoch. */
export type ClaimState = "free" | "claimed" | "granted";

/** Request for a limb that another puppeteer holds: sent to the session, then listed in Presence. */
export type AskState = "none" | "sent" | "listed";

/** Three values of an input. */
export type InputValues = [number, number, number];

/** One limb at a puppeteer. */
export class LimbHold {
  readonly prediction: PredictedLimb;
  /** Id of the holder, as last sent by the session. */
  holder: string | null = null;
  private claimState: ClaimState = "free";
  private currentAskState: AskState = "none";
  private askedAt = 0;
  private currentEpoch = 0;
  private sequence = 0;
  private unsent: "none" | "target" | "velocity" = "none";
  private velocity: InputValues = [0, 0, 0];
  /** True once the session received the target since the grant. */
  private isTargetSent = false;
  private inputAt = 0;
  /** Time of the last input or keep-alive. */
  private lastSentAt = 0;

  /** @param limb number of the limb among those of all performers */
  constructor(readonly limb: number) {
    this.prediction = new PredictedLimb(limb);
  }

  get state(): ClaimState {
    return this.claimState;
  }

  get askState(): AskState {
    return this.currentAskState;
  }

  /** Epoch of the grant; valid while granted. */
  get epoch(): number {
    return this.currentEpoch;
  }

  /** Claim the limb: it is shown as held before the session answers. */
  claim(nowMs: number): void {
    this.claimState = "claimed";
    this.unsent = "none";
    this.prediction.target.claim(nowMs);
  }

  /** Start a grant. The position at which the limb is held here becomes an unsent input. */
  grant(epoch: number, nowMs: number): void {
    this.claimState = "granted";
    this.currentEpoch = epoch;
    this.sequence = 0;
    this.isTargetSent = false;
    if (isMoving(this.velocity)) this.unsent = "velocity";
    else if (this.prediction.target.isKnown) this.unsent = "target";
    this.inputAt = -Infinity;
    this.lastSentAt = nowMs;
  }

  /** End the grant; a claim stays. */
  revoke(): void {
    if (this.claimState === "granted") this.claimState = "claimed";
  }

  /** End claim and grant. */
  release(): void {
    this.claimState = "free";
    this.unsent = "none";
    this.velocity = [0, 0, 0];
    this.prediction.target.release();
  }

  /** Start a request for the limb. */
  ask(nowMs: number): void {
    this.currentAskState = "sent";
    this.askedAt = nowMs;
  }

  /** Record that Presence lists the request. */
  confirmAsk(): void {
    this.currentAskState = "listed";
  }

  /** End the request. */
  endAsk(): void {
    this.currentAskState = "none";
  }

  /** Return true if the session did not list the request in time. */
  isAskOverdue(nowMs: number): boolean {
    return this.currentAskState === "sent" && nowMs - this.askedAt > ASK_TIMEOUT_MS;
  }

  /** Set the target; it becomes an unsent input. */
  setTarget(values: InputValues, nowMs: number): void {
    this.prediction.target.setTarget(...values, nowMs);
    this.velocity = [0, 0, 0];
    this.unsent = "target";
  }

  /** Set the velocity. Return false if it did not change. */
  setVelocity(values: InputValues, nowMs: number): boolean {
    if (values.every((part, axis) => part === this.velocity[axis])) return false;
    this.prediction.target.setVelocity(...values, nowMs);
    this.velocity = values;
    this.unsent = "velocity";
    return true;
  }

  /** Return true if there is an unsent input, and the last one was sent long enough ago. */
  isInputDue(nowMs: number): boolean {
    return this.claimState === "granted" && this.unsent !== "none" && nowMs - this.inputAt >= INPUT_INTERVAL_MS - 1;
  }

  /** Return the messages of the unsent input, `sampled` at reference time in microseconds, and mark it as sent. */
  takeInputs(nowMs: number, sampled: number): Input[] {
    const { target } = this.prediction;
    const inputs: Input[] = [];
    const add = (kind: number, values: InputValues) =>
      inputs.push({
        name: "Input",
        limb: this.limb,
        kind,
        epoch: this.currentEpoch,
        sequence: this.sequence++,
        sampled,
        values,
      });
    target.advance(nowMs);
    if (target.hasFollowed) this.isTargetSent = target.hasFollowed = false;
    const sendsVelocity = this.unsent === "velocity" && isMoving(this.velocity);
    // sent once after the grant and at the end of each movement, so that both ends agree on the position
    if (target.isKnown && !(sendsVelocity && this.isTargetSent)) {
      const [x, y, z] = target.value;
      add(INPUT_TARGET, [x, y, z]);
      this.isTargetSent = true;
    }
    if (sendsVelocity || !target.isKnown) add(INPUT_VELOCITY, this.velocity);
    this.unsent = "none";
    this.inputAt = this.lastSentAt = nowMs;
    return inputs;
  }

  /** Return true if a keep-alive message is due. */
  isAliveDue(nowMs: number): boolean {
    return this.claimState === "granted" && nowMs - this.lastSentAt >= ALIVE_INTERVAL_MS;
  }

  /** Record a sent keep-alive message. */
  markAlive(nowMs: number): void {
    this.lastSentAt = nowMs;
  }
}

function isMoving(velocity: InputValues): boolean {
  return velocity.some((part) => part !== 0);
}
