/**
 * Moves limbs by speed: every key, pad control and button of the page that is held down stands here with the input it means. The first press takes the limb,
 * several at once add up, opposite ones cancel (`directionOf`).
 */
import { MAX_LIMBS, performerOfLimb } from "../wire/limbs";
import { combineDirections, type DigitalInput, effectOf, type SelectedLimbInput } from "./digital-input";
import type { LimbController } from "./limb-controller";
import { PerformerSelection } from "./performer-selection";

/** A limb taken by a push alone, all its inputs at rest for this long, is let go, and the dance has it back. Milliseconds. */
const RELEASE_DELAY_MS = 700;
/** A limb that another held is tried again no sooner than this after it came free. Milliseconds. */
const CLAIM_RETRY_MS = 300;
/** The first of these that is held of the chosen performer is selected. */
const SELECTION_ORDER = [1, 0, 3, 2];

export interface VelocityActions {
  /** Takes a limb for these inputs; false, and the person is told why, when it cannot be had. */
  claim(limb: number): boolean;
  /** Whether nobody holds a limb. */
  isFree(limb: number): boolean;
  /** Whose limbs the inputs move; left out, the first's. */
  selection?: PerformerSelection;
}

/** Inputs of one limb, and how strongly each is pressed. */
type LimbInputs = [DigitalInput | SelectedLimbInput, number][];

interface LimbMotion {
  isActive: boolean;
  /** When it was last active, and last tried for, milliseconds. */
  movedAt: number;
  triedAt: number;
  /** Taken by a push, and let go by rest. */
  isMomentary: boolean;
  /** Lost or let go while the push goes on: it has to rest before it takes again. */
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
  /** What is held of each limb since the last frame. */
  #limbInputs: LimbInputs[] = emptyLimbInputs();

  constructor(hands: LimbController, actions: VelocityActions) {
    this.#limbController = hands;
    this.#actions = actions;
    this.#selection = actions.selection ?? new PerformerSelection();
  }

  /** The chosen performer's limb of this name: `part` counts as `LIMBS`. */
  limb(part: number): number {
    return this.#selection.limb(part);
  }

  /** The limb of the chosen performer that the inputs of "whichever is held" move: one that a pointer pulls before the one taken last; null for none. */
  get selectedLimb(): number | null {
    const own = SELECTION_ORDER.map((part) => this.limb(part));
    const last = this.#lastSelectedLimb;
    if (last === null || performerOfLimb(last) !== this.#selection.performer || !this.holds(last))
      this.#lastSelectedLimb = own.find((limb) => this.holds(limb)) ?? null;
    return own.find((limb) => this.#limbController.source(limb) === "pointer") ?? this.#lastSelectedLimb;
  }

  /** How fast a limb that a pointer pulls over the screen is moved nearer to the audience, -1 to 1: what a pointer cannot say. */
  depthInput(limb: number): number {
    return combineDirections(this.#limbInputs[limb])[2];
  }

  /** Presses an input by a control (any name), or changes how strongly; 0 lets it up. */
  set(control: string, input: DigitalInput | SelectedLimbInput, strength: number): void {
    if (strength > 0) this.#pressed.set(`${control} ${input}`, { input, strength });
    else this.#pressed.delete(`${control} ${input}`);
  }

  /** Whether a limb is held until it is let go, and not by a push alone. */
  holds(limb: number): boolean {
    return this.#limbController.source(limb) === "velocity" && !this.#motions[limb].isMomentary;
  }

  /** Holds a limb until it is let go, and selects it. False when it cannot be had. */
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

  /** Lets go whatever is held until it is let go, of all performers; whether anything was, or is pulled by a pointer. */
  releaseAll(): boolean {
    let held = false;
    for (let limb = 0; limb < MAX_LIMBS; limb++) {
      held ||= this.holds(limb) || this.#limbController.source(limb) === "pointer";
      this.release(limb);
    }
    return held;
  }

  /** Takes, moves and lets go as the inputs say. Once a frame, with a time that never runs backwards, milliseconds. */
  update(now: number): void {
    const selected = this.selectedLimb;
    const held = emptyLimbInputs();
    for (const { input, strength } of this.#pressed.values()) {
      const part = effectOf(input).limb;
      const limb = part === null ? selected : this.limb(part);
      if (limb !== null) held[limb].push([input, strength]);
    }
    this.#limbInputs = held;
    held.forEach((inputs, limb) => this.#updateLimb(limb, inputs, now));
  }

  #updateLimb(limb: number, inputs: LimbInputs, now: number): void {
    const motion = this.#motions[limb];
    const fresh = inputs.length > 0 && !motion.isActive;
    if (motion.isMomentary && this.#limbController.source(limb) !== "velocity") {
      motion.isMomentary = false;
      motion.needsRest = true;
    }
    motion.isActive = inputs.length > 0;
    if (motion.isActive) motion.movedAt = now;
    else motion.needsRest = false;
    const again = !motion.needsRest && now - motion.triedAt >= CLAIM_RETRY_MS && this.#actions.isFree(limb);
    if (motion.isActive && this.#limbController.source(limb) === null && (fresh || again)) {
      motion.triedAt = now;
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
