/** Predictions of all bonds of this page's hands. Their code is loaded with the second hand, or the first bond. */

import { performerOfLimb } from "../wire/limbs";
import type { LimbPair } from "./bond-requests";
import type { StagedFrame } from "./performer-view";
import type { PredictedBond, PredictedHand } from "./predicted-bond";
import type { BondedLimb } from "./predicted-limb";

const NO_BONDS: ReadonlyMap<number, BondedLimb> = new Map();

/** Bonds at one puppeteer. */
export class BondPredictor {
  private readonly bonds = new Map<string, PredictedBond>();
  private code: typeof import("./predicted-bond") | null = null;
  private isLoading = false;

  /** @param handOf function that returns prediction and holder of a limb */
  constructor(private readonly handOf: (limb: number) => Omit<PredictedHand, "frame">) {}

  /** Start to load the code, unless it is loaded or in progress. Until then bonds are shown as the session sends them. */
  load(): void {
    if (this.code || this.isLoading) return;
    this.isLoading = true;
    void import("./predicted-bond")
      .then(
        (code) => void (this.code = code),
        (error: unknown) =>
          console.warn("Prediction of joined hands not loaded: they are shown with the delay of the session.", error),
      )
      .then(() => void (this.isLoading = false));
  }

  /** Return what the bonds `pairs` do to the limbs of the frame's performer, by number. */
  predict(frame: StagedFrame, pairs: readonly LimbPair[]): ReadonlyMap<number, BondedLimb> {
    if (pairs.length === 0 && this.bonds.size === 0) return NO_BONDS;
    const bonded = new Map<number, BondedLimb>();
    const keys = new Set(pairs.map(String));
    for (const key of this.bonds.keys()) if (!keys.has(key)) this.bonds.delete(key);
    for (const pair of pairs) {
      if (!pair.some((limb) => performerOfLimb(limb) === frame.performer)) continue;
      const [first, second] = pair.map((limb) => this.hand(limb, frame));
      if (this.code && first && second && (first.holder === "own" || second.holder === "own")) {
        const bond = this.bonds.get(String(pair)) ?? new this.code.PredictedBond();
        this.bonds.set(String(pair), bond);
        const places = bond.advance([first, second]);
        pair.forEach((limb, side) => bonded.set(limb, places?.[side] ?? null));
      } else {
        this.bonds.delete(String(pair));
        for (const limb of pair) bonded.set(limb, "shown");
      }
    }
    return bonded;
  }

  private hand(limb: number, frame: StagedFrame): PredictedHand | null {
    const performer = performerOfLimb(limb);
    const own = performer === frame.performer ? frame : frame.partner(performer);
    return own && { ...this.handOf(limb), frame: own };
  }
}
