/** Fingers of hands that hold props: they close around a shaft, or lie around a ball. */
import type { StagedPose } from "../../motion/extension";
import { CHAIN_COUNT, chainDirection, FINGERS, type Hands, MAX_CHAIN_JOINTS } from "../../motion/hands";
import type { PropForm } from "../../motion/props";
import { limbWithinPerformer, performerOfLimb } from "../../wire/limbs";
import type { PropPresence } from "../../wire/messages";

/** Bends of the three joints of the thumb and of the other fingers towards the palm, in radians. */
interface Grip {
  readonly thumb: readonly number[];
  readonly finger: readonly number[];
}

const SHAFT: Grip = { thumb: [0.35, 0.5, 0.5], finger: [1.15, 1.35, 0.7] };
const BALL: Grip = { thumb: [0.3, 0.2, 0.1], finger: [0.3, 0.3, 0.2] };
/** Bend of fingers that the motion does not move, in radians: about that of the models. */
const REST_BEND_RAD = 0.12;
/** Time in which a hand closes and opens, in seconds. */
const CLOSING_S = 0.25;
const HAND_CHAINS = CHAIN_COUNT / 2;

/** Axes about which the joints of a chain bend to the palm, in the frame of the wrist: the direction times the palm's. */
const BEND_AXES = Array.from({ length: CHAIN_COUNT }, (_, chain) => {
  const [, y, z] = chainDirection(chain);
  const palm = chain < HAND_CHAINS ? -1 : 1;
  return [0, z * palm, -y * palm];
});

/** A prop that is drawn, and its form. */
export type FormedProp = PropPresence & { readonly form: PropForm };

/** Grip of one hand. */
interface HandGrip {
  grip: Grip;
  /** 0 open .. 1 closed. */
  closed: number;
  isHolding: boolean;
}

/** Grips of the hands of one performer. */
export class PropGrip {
  readonly #hands: readonly HandGrip[] = [0, 1].map(() => ({ grip: SHAFT, closed: 0, isHolding: false }));
  /** Joints of the last pose, and those of the motion and the hands that they were made for. */
  #joints: Hands | null = null;
  #source: Hands | null = null;
  #closedHands = "";

  /** Advance by `seconds`, with Infinity at once, to what the performer of this number holds. */
  update(props: readonly FormedProp[], performer: number, seconds: number): void {
    for (const hand of this.#hands) hand.isHolding = false;
    for (const { form, limb } of props)
      if (limb !== null && performerOfLimb(limb) === performer)
        Object.assign(this.#hands[limbWithinPerformer(limb)], {
          grip: form.palmOffset > 0 ? BALL : SHAFT,
          isHolding: true,
        });
    for (const hand of this.#hands) {
      const step = seconds / CLOSING_S;
      hand.closed = hand.isHolding ? Math.min(1, hand.closed + step) : Math.max(0, hand.closed - step);
    }
  }

  /** Return the pose with the fingers of hands that hold something closed; the same if none does. */
  apply(pose: StagedPose): StagedPose {
    if (this.#hands.every(({ closed }) => closed === 0)) return pose;
    const joints = this.#fitJoints(pose.hands?.hands ?? null);
    const values = new Float64Array(joints.counts.reduce((sum, count) => sum + count) * 3);
    let [from, to] = [0, 0];
    joints.counts.forEach((count, chain) => {
      const known = pose.hands?.hands.counts[chain] ?? 0;
      const { closed, grip } = this.#hands[Math.floor(chain / HAND_CHAINS)];
      const bends = chain % FINGERS.length === 0 ? grip.thumb : grip.finger;
      for (let i = 0; i < count * 3; i++) {
        const axis = BEND_AXES[chain][i % 3];
        const moved = i < known * 3 ? (pose.hands?.values[from * 3 + i] ?? 0) : 0;
        const open = known > 0 ? moved : REST_BEND_RAD * axis;
        values[to * 3 + i] = open + closed * (bends[Math.floor(i / 3)] * axis - open);
      }
      from += known;
      to += count;
    });
    return { ...pose, hands: { hands: joints, values } };
  }

  /** Return the joints of the motion, with all of those of hands that are not open: the same ones until they change. */
  #fitJoints(source: Hands | null): Hands {
    const closedHands = this.#hands.map(({ closed }) => Number(closed > 0)).join("");
    if (this.#joints && this.#source === source && this.#closedHands === closedHands) return this.#joints;
    this.#source = source;
    this.#closedHands = closedHands;
    this.#joints = {
      counts: Array.from({ length: CHAIN_COUNT }, (_, chain) =>
        this.#hands[Math.floor(chain / HAND_CHAINS)].closed > 0 ? MAX_CHAIN_JOINTS : (source?.counts[chain] ?? 0),
      ),
      bases: source?.bases ?? new Float64Array(CHAIN_COUNT * 3),
      lengths: source?.lengths ?? new Float64Array(CHAIN_COUNT * MAX_CHAIN_JOINTS),
    };
    return this.#joints;
  }
}
