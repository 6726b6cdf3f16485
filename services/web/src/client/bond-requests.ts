/**
 * Bonds that this page has requested, and those that it is ending. A requested bond counts before the session answers,
 * and one that was lost with the connection or with its hands is requested again. Times are local milliseconds.
 */

import type { LimbHold } from "./limb-hold";

/** Two hands, the lower limb number first. */
export type LimbPair = readonly [number, number];

/** Time after which an unanswered request expires: a session may have no support for bonds. */
const ANSWER_TIMEOUT_MS = 5_000;

/** Request for a bond: "lost" until its hands are granted again. */
interface BondRequest {
  readonly pair: LimbPair;
  state: "requested" | "confirmed" | "lost";
  requestedAt: number;
}

/** Return two hands in order. */
export function orderedPair(limb: number, other: number): LimbPair {
  return limb < other ? [limb, other] : [other, limb];
}

/** Requests for bonds at one puppeteer. */
export class BondRequests {
  private readonly requests = new Map<string, BondRequest>();
  /** Bonds that this page ends and the session still lists. */
  private readonly ending = new Set<string>();

  /** Add a request that is sent now. */
  request(pair: LimbPair, nowMs: number): void {
    this.ending.delete(String(pair));
    this.requests.set(String(pair), { pair, state: "requested", requestedAt: nowMs });
  }

  /** End a bond: until the session has ended it, too, it does not count. */
  end(pair: LimbPair, isListed: boolean): void {
    this.requests.delete(String(pair));
    if (isListed) this.ending.add(String(pair));
  }

  /** Return the bonds that count: those that the session lists and the requested ones, without those that end. */
  effective(listed: readonly LimbPair[], nowMs: number): readonly LimbPair[] {
    if (this.requests.size === 0 && this.ending.size === 0) return listed;
    const pairs = new Map(listed.map((pair) => [String(pair), pair]));
    for (const [key, { pair, state, requestedAt }] of this.requests)
      if (state === "requested" && nowMs - requestedAt < ANSWER_TIMEOUT_MS) pairs.set(key, pair);
    for (const key of this.ending) pairs.delete(key);
    return [...pairs.values()];
  }

  /** Apply the session's list of bonds. */
  confirm(listed: readonly LimbPair[]): void {
    const keys = new Set(listed.map(String));
    for (const [key, request] of this.requests) if (keys.has(key)) request.state = "confirmed";
    for (const key of this.ending) if (!keys.has(key)) this.ending.delete(key);
  }

  /** Apply the end or the refusal of a bond. It stays wanted if it was lost with a hand that is claimed again. */
  applyEnd(pair: LimbPair, reason: string, holds: readonly LimbHold[]): void {
    const key = String(pair);
    this.ending.delete(key);
    const request = this.requests.get(key);
    if (request && reason === "lost" && pair.some((limb) => holds[limb].state === "claimed")) request.state = "lost";
    else this.requests.delete(key);
  }

  /** Record the loss of the connection: all wanted bonds are lost. */
  disconnect(): void {
    this.ending.clear();
    for (const request of this.requests.values()) request.state = "lost";
  }

  /** Return the lost bonds to request again after the grant of `limb`, once no hand of them waits for its grant. */
  takeLost(limb: number, holds: readonly LimbHold[], nowMs: number): LimbPair[] {
    const found: LimbPair[] = [];
    for (const request of this.requests.values()) {
      const { pair, state } = request;
      if (state !== "lost" || !pair.includes(limb) || pair.some((hand) => holds[hand].state === "claimed")) continue;
      request.state = "requested";
      request.requestedAt = nowMs;
      found.push(pair);
    }
    return found;
  }
}
