/** Hands of performers for tests. */
import { CHAIN_COUNT, chainJoints, type Hands, type HandsPose, MAX_CHAIN_JOINTS } from "../../src/motion/hands";

/** Create hands with the same number of joints in each finger. */
export function createHands(count: number | readonly number[] = MAX_CHAIN_JOINTS): Hands {
  const counts = typeof count === "number" ? new Array<number>(CHAIN_COUNT).fill(count) : count;
  const bases = new Float64Array(CHAIN_COUNT * 3);
  const lengths = new Float64Array(CHAIN_COUNT * MAX_CHAIN_JOINTS);
  counts.forEach((joints, chain) => {
    const finger = chain % 5;
    if (joints > 0) bases.set(finger === 0 ? [0, -0.02, 0.03] : [0, -0.09, 0.045 - 0.02 * finger], chain * 3);
    for (let place = 0; place < joints; place++) lengths[chain * MAX_CHAIN_JOINTS + place] = 0.04 - 0.008 * place;
  });
  return { counts, bases, lengths };
}

/** Return a pose of hands; `turn` gives the rotation vector of a joint. */
export function poseOfHands(
  hands: Hands,
  turn: (chain: number, place: number) => readonly [number, number, number],
): HandsPose {
  const joints = chainJoints(hands);
  const values = new Float64Array(joints.length * 3);
  joints.forEach(([chain, place], joint) => {
    values.set(turn(chain, place), joint * 3);
  });
  return { hands, values };
}

/** Return a rotation vector that bends a finger of the I-pose by an angle: towards the palm, which faces the body. */
export function bendFinger(chain: number, angle: number): readonly [number, number, number] {
  return chain % 5 === 0 ? [0.3 * angle, 0, 0] : [0, 0, chain < 5 ? -angle : angle];
}
