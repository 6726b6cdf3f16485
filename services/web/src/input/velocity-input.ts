/**
 * Velocity control of limbs: collects the inputs of all pressed keys, gamepad controls and buttons. The first press
 * claims the limb; several add up and opposite ones cancel (`combineDirections`).
 */
import { MAX_LIMBS, performerOfLimb } from "../wire/limbs";
import { combineDirections, type DigitalInput, effectOf, type SelectedLimbInput } from "./digital-input";
import type { LimbController } from "./limb-controller";
import { PerformerSelection } from "./performer-selection";

/** A limb claimed by a push is released after this time without input, in milliseconds. */
const RELEASE_DELAY_MS = 700;
/** Minimum time between attempts to claim a limb that another puppeteer held, in milliseconds. */
const CLAIM_RETRY_MS = 300;
/** The first held limb in this order is selected. */
const SELECTION_ORDER = [1, 0, 3, 2];

export interface VelocityActions {
  /** Claim a limb for these inputs. Return false if it is not available; the user has been told why. */
  claim(limb: number): boolean;
  /** True if no puppeteer holds a limb. */
  isFree(limb: number): boolean;
  /** Performer whose limbs the inputs move; the first by default. */
  selection?: PerformerSelection;
}

/** Inputs of one limb, and how strongly each is pressed. */
type LimbInputs = [DigitalInput | SelectedLimbInput, number][];

interface LimbMotion {
  isActive: boolean;
  /** Times of the last input and of the last attempt to claim, in milliseconds. */
  movedAt: number;
  triedAt: number;
  /** True if the limb was claimed by a push and is released by rest. */
  isMomentary: boolean;
  /** True if the limb was lost or released during a push: it must rest before the next claim. */
  needsRest: boolean;
}

export class VelocityInputs {
  readonly #limbController: LimbController;
  readonly #actions: VelocityActions;
  readonly #pressed = new Map<string, { input: DigitalInput | SelectedLimbInput; strength: number }>();
  readonly #selection: PerformerSelection;
  readonly #motions: LimbMotion[] = Array.from({ length: MAX_LIMBS }, () => ({
    isActive: false,
    movedAt: -Infinity,
    triedAt: -Infinity,
    isMomentary: false,
    needsRest: false,
  }));
  #lastSelectedLimb: number | null = null;
  /** Inputs of each limb in the last frame. */
  #limbInputs: LimbInputs[] = emptyLimbInputs();

  constructor(limbController: LimbController, actions: VelocityActions) {
    this.#limbController = limbController;
    this.#actions = actions;
    this.#selection = actions.selection ?? new PerformerSelection();
  }

  /** Return the number of a limb of the selected performer; `part` indexes `LIMBS`. */
  limb(index: number): number {
    return this.#selection.limb(index);
  }

  /** Limb that inputs for "the held limb" move: one that a pointer pulls, else the one claimed last; null for none. */
  get selectedLimb(): number | null {
    const ownLimbs = SELECTION_ORDER.map((index) => this.limb(index));
    const last = this.#lastSelectedLimb;
    if (last === null || performerOfLimb(last) !== this.#selection.performer || !this.holds(last))
      this.#lastSelectedLimb = ownLimbs.find((limb) => this.holds(limb)) ?? null;
    return ownLimbs.find((limb) => this.#limbController.source(limb) === "pointer") ?? this.#lastSelectedLimb;
  }

  /** Return the speed towards the audience, -1 to 1, of a limb that a pointer pulls: a pointer cannot set the depth. */
  depthInput(limb: number): number {
    return combineDirections(this.#limbInputs[limb])[2];
  }

  /** Set the strength of an input by a control (any name); 0 releases it. */
  set(control: string, input: DigitalInput | SelectedLimbInput, strength: number): void {
    if (strength > 0) this.#pressed.set(`${control} ${input}`, { input, strength });
    else this.#pressed.delete(`${control} ${input}`);
  }

  /** Return whether a limb is held until its release, not only by a push. */
  holds(limb: number): boolean {
    return this.#limbController.source(limb) === "velocity" && !this.#motions[limb].isMomentary;
  }

  /** Hold a limb until its release and select it. Return false if it is not available. */
  hold(limb: number): boolean {
    if (this.#limbController.source(limb) !== "velocity" && !this.#actions.claim(limb)) return false;
    this.#motions[limb].isMomentary = false;
    this.#lastSelectedLimb = limb;
    this.#limbController.onChange();
    return true;
  }

  release(limb: number): void {
    if (this.#limbController.source(limb) !== "velocity") return;
    this.#motions[limb].needsRest = this.#motions[limb].isActive;
    this.#limbController.release(limb);
  }

  /** Release all limbs held by velocity, of all performers. Return whether any was held, or is pulled by a pointer. */
  releaseAll(): boolean {
    let held = false;
    for (let limb = 0; limb < MAX_LIMBS; limb++) {
      held ||= this.holds(limb) || this.#limbController.source(limb) === "pointer";
      this.release(limb);
    }
    return held;
  }

  /**
   * Claim, move and release limbs by the current inputs, once per frame. `now` is in milliseconds and never decreases.
   */
  update(now: number): void {
    const selected = this.selectedLimb;
    const held = emptyLimbInputs();
    for (const { input, strength } of this.#pressed.values()) {
      const index = effectOf(input).limb;
      const limb = index === null ? selected : this.limb(index);
      if (limb !== null) held[limb].push([input, strength]);
    }
    this.#limbInputs = held;
    held.forEach((inputs, limb) => this.#updateLimb(limb, inputs, now));
  }

  #updateLimb(limb: number, inputs: LimbInputs, now: number): void {
    const motion = this.#motions[limb];
    const isNewPush = inputs.length > 0 && !motion.isActive;
    if (motion.isMomentary && this.#limbController.source(limb) !== "velocity") {
      motion.isMomentary = false;
      motion.needsRest = true;
    }
    motion.isActive = inputs.length > 0;
    if (motion.isActive) motion.movedAt = now;
    else motion.needsRest = false;
    const canRetry = !motion.needsRest && now - motion.triedAt >= CLAIM_RETRY_MS && this.#actions.isFree(limb);
    if (motion.isActive && this.#limbController.source(limb) === null && (isNewPush || canRetry)) {
      motion.triedAt = now;
      // Before the claim, which reports the held limbs.
      motion.isMomentary = true;
      motion.isMomentary = this.#actions.claim(limb);
    }
    if (this.#limbController.source(limb) !== "velocity") return;
    this.#limbController.move(limb, ...combineDirections(inputs));
    if (motion.isMomentary && now - motion.movedAt > RELEASE_DELAY_MS) {
      motion.isMomentary = false;
      this.#limbController.release(limb);
    }
  }
}

function emptyLimbInputs(): LimbInputs[] {
  return Array.from({ length: MAX_LIMBS }, () => []);
}
