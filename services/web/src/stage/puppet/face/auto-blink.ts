/** Blinks of the performers on a stage: by themselves, more likely at turns of the head, and only while they move. */
import { blinkAt, blinkWeight, CLOSING_S, OPENING_S, randomOf } from "../../../motion/blink";
import { multiply } from "../../../motion/rotation";
import { JOINTS, type Pose } from "../../../motion/skeleton";

/** Joints whose rotations turn the head. */
const HEAD_CHAIN = ["humanoid_root", "vl5", "skullbase"].map((name) => JOINTS.indexOf(name));
/** Angular speed of a head's turn that may come with a blink, in rad/s. */
const TURN_RAD_PER_S = 2.5;
/** Share of turns with a blink, and the time in which there is at most one, in seconds. */
const TURN_SHARE = 0.5;
const TURN_INTERVAL_S = 1.5;

class BlinkState {
  readonly rotations = new Float64Array(JOINTS.length * 4);
  readonly root = new Float64Array(3);
  readonly head = new Float64Array(4);
  clockS = 0;
  /** Begin of the last blink at a turn. */
  turnS = -Infinity;
  closed = 0;
}

const head = new Float64Array(4);

export class AutoBlink {
  readonly #states: BlinkState[] = [];

  /**
   * Return how far the eyes of a performer are closed, 0..1. `clockS` is the clock time of the pose; `seconds` since
   * the last call is 0 if nothing may move that is not in the motion.
   */
  update(performer: number, pose: Pose, clockS: number, seconds: number): number {
    const state = (this.#states[performer] ??= new BlinkState());
    const isMoving = noteChange(state.rotations, pose.rotations) || noteChange(state.root, pose.root);
    if (seconds <= 0) return (state.closed = 0);
    if (isMoving) this.#noteTurn(state, performer, pose, clockS);
    state.clockS = clockS;
    const target = isMoving ? Math.max(blinkWeight(clockS, performer), blinkAt(clockS - state.turnS)) : 0;
    // Eyes that are closed when the motion stops open, and they close at no jump.
    state.closed = Math.min(Math.max(target, state.closed - seconds / OPENING_S), state.closed + seconds / CLOSING_S);
    return state.closed;
  }

  #noteTurn(state: BlinkState, performer: number, { rotations }: Pose, clockS: number): void {
    head.set(rotations.subarray(0, 4));
    for (const joint of HEAD_CHAIN.slice(1)) multiply(head, 0, head, 0, rotations, joint * 4);
    const cosine = head.reduce((sum, value, i) => sum + value * state.head[i], 0);
    const angle = 2 * Math.acos(Math.min(Math.abs(cosine), 1));
    state.head.set(head);
    const interval = clockS - state.clockS;
    if (interval <= 0 || interval > TURN_INTERVAL_S || angle / interval < TURN_RAD_PER_S) return;
    if (clockS - state.turnS < TURN_INTERVAL_S && clockS >= state.turnS) return;
    if (randomOf(performer, Math.floor(clockS / TURN_INTERVAL_S), 7) < TURN_SHARE) state.turnS = clockS;
  }
}

/** Copy `values` and return whether any differed. */
function noteChange(copy: Float64Array, values: Float64Array): boolean {
  const differs = copy.some((value, i) => value !== values[i]);
  if (differs) copy.set(values);
  return differs;
}
