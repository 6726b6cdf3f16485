/**
 * Hands in space, of controllers or tracked: a closed hand holds the string that it reaches or points at, and pulls it
 * as far as it moves itself. Closing it on a string of another puppeteer asks for that string, until it opens again.
 * Reads no device: positions are arguments, in the stage's world frame and in metres.
 */
import { Ray, Vector3 } from "three";
import { LIMBS } from "../motion/skeleton";
import type { Stage } from "../stage/stage";
import { FREE_THREAD_LENGTH_M } from "../stage/strings/strings";
import { limbNumber, limbWithinPerformer, performerOfLimb } from "../wire/limbs";
import { chooseLimb, type Reach, type Reachable } from "./limb-choice";
import type { LimbController } from "./limb-controller";
import { OneEuro, smoothingSettings } from "./one-euro";
import { PULL_BETA } from "./pointer";

export type Triple = readonly [x: number, y: number, z: number];

/** Name of a hand: that of the body's side, or `none` if it is unknown. */
export type HandName = "left" | "right" | "none";

/** State of a hand at one instant. */
export interface HandState {
  readonly name: HandName;
  readonly position: Triple;
  /** Ray along which the hand points: its origin, and its unit direction. */
  readonly origin: Triple;
  readonly direction: Triple;
  /** Distance within which the hand itself takes a string. */
  readonly reach: number;
  readonly isClosed: boolean;
}

/**
 * What a hand does: it is open, perhaps with a string in reach; it holds one; it asks for one that another puppeteer
 * holds; or it is closed on none, because there was none or because it lost it.
 */
export interface HandGrip {
  readonly name: HandName;
  readonly kind: "open" | "holding" | "asking" | "empty";
  /** Limb in reach, held or asked for. */
  readonly limb: number | null;
}

/** Claims of limbs, for hands. */
export interface HandOptions {
  /** Performer whose strings are taken before those of the others. */
  selectedPerformer(): number;
  isFree(limb: number): boolean;
  /** True if another puppeteer holds a limb. */
  isHeldByOther(limb: number): boolean;
  onClaimed(limb: number): void;
  ask(limb: number): void;
  isAsking(limb: number): boolean;
  withdraw(limb: number): void;
  /** Smoothing of a pull, 0 to 1. */
  smoothing(): number;
}

interface Hand {
  kind: HandGrip["kind"];
  limb: number | null;
  /** Offset from the hand to the target of the pull. */
  readonly offset: Vector3;
  readonly filter: OneEuro;
}

export class HandInput {
  readonly #hands = new Map<HandName, Hand>();

  constructor(
    private readonly stage: Pick<Stage, "performers">,
    private readonly limbs: LimbController,
    private readonly options: HandOptions,
  ) {}

  /** Limbs that hands reach, hold or ask for, highlighted. */
  get limbsInReach(): readonly number[] {
    return [...this.#hands.values()].flatMap(({ limb }) => limb ?? []);
  }

  /**
   * Apply the states of all hands that are tracked, once per frame; the others let go. `now` is in milliseconds and
   * never decreases. Return what each hand does.
   */
  update(states: readonly HandState[], now: number): HandGrip[] {
    for (const [name, hand] of this.#hands) {
      if (states.some((state) => state.name === name)) continue;
      this.#open(hand);
      this.#hands.delete(name);
    }
    return states.map((state) => {
      const hand = this.#hands.get(state.name) ?? createHand();
      this.#hands.set(state.name, hand);
      this.#updateHand(hand, state, now);
      return { name: state.name, kind: hand.kind, limb: hand.limb };
    });
  }

  /** Let go of everything. */
  releaseAll(): void {
    this.update([], 0);
  }

  #updateHand(hand: Hand, state: HandState, now: number): void {
    const position = new Vector3(...state.position);
    if (!state.isClosed) {
      this.#open(hand);
      hand.limb = this.#findLimb(hand, state, position);
      return;
    }
    if (hand.kind === "open") this.#close(hand, this.#findLimb(hand, state, position), position);
    else if (hand.kind === "asking" && hand.limb !== null) this.#awaitGrant(hand, hand.limb, position);
    if (hand.kind === "holding" && hand.limb !== null) this.#pull(hand, hand.limb, position, now);
  }

  #close(hand: Hand, limb: number | null, position: Vector3): void {
    const { limbs, options } = this;
    [hand.kind, hand.limb] = ["empty", null];
    if (limb === null) return;
    if (options.isHeldByOther(limb)) {
      options.ask(limb);
      if (options.isAsking(limb)) [hand.kind, hand.limb] = ["asking", limb];
    } else if (options.isFree(limb) || limbs.source(limb) !== null) this.#take(hand, limb, position);
  }

  /** Hold a limb from where its ring is now. */
  #take(hand: Hand, limb: number, position: Vector3): void {
    if (!this.limbs.claim(limb, "pointer")) return;
    [hand.kind, hand.limb] = ["holding", limb];
    hand.offset.copy(this.#ringOf(limb) ?? position).sub(position);
    hand.filter.reset();
    this.options.onClaimed(limb);
  }

  /** Take a limb that was granted; give up if the request has ended. */
  #awaitGrant(hand: Hand, limb: number, position: Vector3): void {
    if (this.limbs.source(limb) !== null) this.#take(hand, limb, position);
    else if (!this.options.isAsking(limb)) [hand.kind, hand.limb] = ["empty", null];
  }

  #pull(hand: Hand, limb: number, position: Vector3, now: number): void {
    // Refused, revoked, or taken over by a key.
    if (this.limbs.source(limb) !== "pointer") {
      [hand.kind, hand.limb] = ["empty", null];
      return;
    }
    const target = position.clone().add(hand.offset);
    const settings = smoothingSettings(this.options.smoothing(), PULL_BETA);
    if (settings) {
      hand.filter.settings = settings;
      target.fromArray(hand.filter.filter(target.toArray(), now / 1000));
    }
    this.limbs.pullTo(limb, target);
  }

  #open(hand: Hand): void {
    const { kind, limb } = hand;
    if (limb !== null && kind === "holding" && this.limbs.source(limb) === "pointer") this.limbs.release(limb);
    if (limb !== null && kind === "asking") this.options.withdraw(limb);
    [hand.kind, hand.limb] = ["open", null];
  }

  /** Return the limb that a hand would take, of the selected performer if it reaches or points at one of those. */
  #findLimb(hand: Hand, { origin, direction, reach }: HandState, position: Vector3): number | null {
    const ray = new Ray(new Vector3(...origin), new Vector3(...direction));
    const reached: Reach = { position, ray, distance: reach };
    const closed = [...this.#hands.values()].filter((other) => other !== hand && other.kind !== "open");
    const strings = this.#strings().filter(({ limb }) => !closed.some((other) => other.limb === limb));
    const selected = this.options.selectedPerformer();
    const own = strings.filter(({ limb }) => performerOfLimb(limb) === selected);
    return chooseLimb(own, reached) ?? chooseLimb(strings, reached);
  }

  #strings(): Reachable[] {
    return this.stage.performers.flatMap((performer, k) =>
      LIMBS.flatMap((_, limb) => {
        if (!performer.group.visible) return [];
        const ring = performer.handle(limb, new Vector3());
        const top = ring.clone().setY(ring.y + FREE_THREAD_LENGTH_M[limb < 2 ? 0 : 1] * performer.scale);
        return { limb: limbNumber(k, limb), ring, top };
      }),
    );
  }

  #ringOf(limb: number): Vector3 | null {
    return this.stage.performers[performerOfLimb(limb)]?.handle(limbWithinPerformer(limb), new Vector3()) ?? null;
  }
}

function createHand(): Hand {
  return {
    kind: "open",
    limb: null,
    offset: new Vector3(),
    filter: new OneEuro(3, { minCutoff: 1, beta: PULL_BETA, derivativeCutoff: 1 }),
  };
}
