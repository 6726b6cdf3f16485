/**
 * Moves limbs by speed: every key, pad control and button of the page that is held down stands here with the input it means. The first press takes the limb,
 * several at once add up, opposite ones cancel (`directionOf`).
 */
import { MOST_LIMBS, performerOf } from "../wire/limbs";
import { Chosen } from "./chosen";
import type { Hands } from "./hands";
import { directionOf, effectOf, type DigitalInput, type HeldInput } from "./inputs";

/** A limb taken by a push alone, all its inputs at rest for this long, is let go, and the dance has it back. Milliseconds. */
const REST = 700;
/** A limb that another held is tried again no sooner than this after it came free. Milliseconds. */
const PATIENCE = 300;
/** The first of these that is held of the chosen performer is selected. */
const ORDER = [1, 0, 3, 2];

export interface VelocityActions {
  /** Takes a limb for these inputs; false, and the person is told why, when it cannot be had. */
  take(limb: number): boolean;
  /** Whether nobody holds a limb. */
  free(limb: number): boolean;
  /** Whose limbs the inputs move; left out, the first's. */
  chosen?: Chosen;
}

/** Inputs of one limb, and how strongly each is pressed. */
type Held = [DigitalInput | HeldInput, number][];

interface Motion {
  active: boolean;
  /** When it was last active, and last tried for, milliseconds. */
  movedAt: number;
  triedAt: number;
  /** Taken by a push, and let go by rest. */
  momentary: boolean;
  /** Lost or let go while the push goes on: it has to rest before it takes again. */
  spent: boolean;
}

export class VelocityInputs {
  readonly #hands: Hands;
  readonly #actions: VelocityActions;
  readonly #down = new Map<string, { input: DigitalInput | HeldInput; strength: number }>();
  readonly #chosen: Chosen;
  readonly #motions: Motion[] = Array.from({ length: MOST_LIMBS }, () => ({ active: false, movedAt: -Infinity, triedAt: -Infinity, momentary: false, spent: false }));
  #selected: number | null = null;
  /** What is held of each limb since the last frame. */
  #held: Held[] = noneHeld();

  constructor(hands: Hands, actions: VelocityActions) {
    this.#hands = hands;
    this.#actions = actions;
    this.#chosen = actions.chosen ?? new Chosen();
  }

  /** The chosen performer's limb of this name: `part` counts as `LIMBS`. */
  limb(part: number): number {
    return this.#chosen.limb(part);
  }

  /** The limb of the chosen performer that the inputs of "whichever is held" move: one that a pointer pulls before the one taken last; null for none. */
  get selected(): number | null {
    const own = ORDER.map((part) => this.limb(part));
    const last = this.#selected;
    if (last === null || performerOf(last) !== this.#chosen.performer || !this.holds(last)) this.#selected = own.find((limb) => this.holds(limb)) ?? null;
    return own.find((limb) => this.#hands.source(limb) === "pointer") ?? this.#selected;
  }

  /** How fast a limb that a pointer pulls over the screen is moved nearer to the audience, -1 to 1: what a pointer cannot say. */
  nearer(limb: number): number {
    return directionOf(this.#held[limb])[2];
  }

  /** Presses an input by a control (any name), or changes how strongly; 0 lets it up. */
  set(control: string, input: DigitalInput | HeldInput, strength: number): void {
    if (strength > 0) this.#down.set(`${control} ${input}`, { input, strength });
    else this.#down.delete(`${control} ${input}`);
  }

  /** Whether a limb is held until it is let go, and not by a push alone. */
  holds(limb: number): boolean {
    return this.#hands.source(limb) === "velocity" && !this.#motions[limb].momentary;
  }

  /** Holds a limb until it is let go, and selects it. False when it cannot be had. */
  hold(limb: number): boolean {
    if (this.#hands.source(limb) !== "velocity" && !this.#actions.take(limb)) return false;
    this.#motions[limb].momentary = false;
    this.#selected = limb;
    this.#hands.changed();
    return true;
  }

  letGo(limb: number): void {
    if (this.#hands.source(limb) !== "velocity") return;
    this.#motions[limb].spent = this.#motions[limb].active;
    this.#hands.letGo(limb);
  }

  /** Lets go whatever is held until it is let go, of all performers; whether anything was, or is pulled by a pointer. */
  letAllGo(): boolean {
    let held = false;
    for (let limb = 0; limb < MOST_LIMBS; limb++) {
      held ||= this.holds(limb) || this.#hands.source(limb) === "pointer";
      this.letGo(limb);
    }
    return held;
  }

  /** Takes, moves and lets go as the inputs say. Once a frame, with a time that never runs backwards, milliseconds. */
  update(now: number): void {
    const selected = this.selected;
    const held = noneHeld();
    for (const { input, strength } of this.#down.values()) {
      const part = effectOf(input).limb;
      const limb = part === null ? selected : this.limb(part);
      if (limb !== null) held[limb].push([input, strength]);
    }
    this.#held = held;
    held.forEach((inputs, limb) => this.#move(limb, inputs, now));
  }

  #move(limb: number, inputs: Held, now: number): void {
    const motion = this.#motions[limb];
    const fresh = inputs.length > 0 && !motion.active;
    if (motion.momentary && this.#hands.source(limb) !== "velocity") {
      motion.momentary = false;
      motion.spent = true;
    }
    motion.active = inputs.length > 0;
    if (motion.active) motion.movedAt = now;
    else motion.spent = false;
    const again = !motion.spent && now - motion.triedAt >= PATIENCE && this.#actions.free(limb);
    if (motion.active && this.#hands.source(limb) === null && (fresh || again)) {
      motion.triedAt = now;
      motion.momentary = this.#actions.take(limb);
    }
    if (this.#hands.source(limb) !== "velocity") return;
    this.#hands.move(limb, ...directionOf(inputs));
    if (motion.momentary && now - motion.movedAt > REST) {
      motion.momentary = false;
      this.#hands.letGo(limb);
    }
  }
}

function noneHeld(): Held[] {
  return Array.from({ length: MOST_LIMBS }, () => []);
}
