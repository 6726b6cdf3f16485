/** Fingers in a track: description of their joints, layout of their blocks, and weights (`proto/codec.md`, 2.18). */

import { CHAIN_COUNT, chainJoints, FINGERS, type Hands, MAX_CHAIN_JOINTS } from "../../motion/hands";
import { JOINTS } from "../../motion/skeleton";
import { type ChannelLayout, createLayout } from "../channel-layout";
import { DamagedBlock } from "../errors";
import { decodeIntegers } from "../integer-coder";
import { LENGTH_UNIT_M } from "./body-joints";
import { toScales } from "./scale-offsets";

const MAX_FINGER_BYTES = 512;
/** Bytes of the numbers of joints, two bits for each chain. */
const COUNTS_BYTES = 3;
const PRIOR_CHANNEL = JOINTS.indexOf("l_wrist") + 1;
/** Lever arm about the bone of a finger, in metres. */
const TWIST_RADIUS_M = 0.01;

/**
 * Returns the fingers that the bytes of `joints` describe, and the offsets [E][3] of their scales.
 *
 * @throws DamagedBlock
 */
export function unpackFingers(data: Uint8Array): [Hands, number[]] {
  const packed = (data[0] ?? 0) | ((data[1] ?? 0) << 8) | ((data[2] ?? 0) << 16);
  const counts = Array.from({ length: CHAIN_COUNT }, (_, chain) => (packed >> (2 * chain)) & 3);
  const hasJoints = packed !== 0 && packed >> (2 * CHAIN_COUNT) === 0;
  if (!hasJoints || data.length < COUNTS_BYTES || data.length > MAX_FINGER_BYTES) {
    throw new DamagedBlock(
      `Invalid fingers: their description has ${data.length} bytes, expected joints and ` +
        `${COUNTS_BYTES}..${MAX_FINGER_BYTES} bytes.`,
    );
  }
  const joints = chainJoints({ counts });
  const integers = decodeIntegers(data.subarray(COUNTS_BYTES), ...integerModels(joints)).values();
  const next = () => Number(integers.next().value);
  const hands: Hands = {
    counts,
    bases: new Float64Array(CHAIN_COUNT * 3),
    lengths: new Float64Array(CHAIN_COUNT * MAX_CHAIN_JOINTS),
  };
  const offsets = joints.flatMap(([chain, place]) => {
    if (place === 0) for (let i = 0; i < 3; i++) hands.bases[chain * 3 + i] = next() * LENGTH_UNIT_M;
    hands.lengths[chain * MAX_CHAIN_JOINTS + place] = next() * LENGTH_UNIT_M;
    return [next(), next(), next()];
  });
  return [hands, offsets];
}

/**
 * Returns the group of models of each integer that describes the joints, and the integer that it mirrors. Groups are
 * bases by axis (0-2), lengths (3), offsets (4), mirrored bases and lengths (5) and offsets (6). A joint of the right
 * hand mirrors that of the left hand.
 */
function integerModels(joints: readonly (readonly [chain: number, place: number])[]): [number[], number[]] {
  const groups: number[] = [];
  const mirrors: number[] = [];
  const first = new Map<string, number>();
  for (const [chain, place] of joints) {
    first.set(`${chain} ${place}`, groups.length);
    const twin = first.get(`${chain - FINGERS.length} ${place}`) ?? -1;
    for (const [index, group] of [...(place === 0 ? [0, 1, 2] : []), 3, 4, 4, 4].entries()) {
      groups.push(twin < 0 ? group : group === 4 ? 6 : 5);
      mirrors.push(twin < 0 ? -1 : twin + index);
    }
  }
  return [groups, mirrors];
}

/** Returns the layout of the blocks: each finger is a chain. */
export function fingerLayout(hands: Hands, offsets: readonly number[]): ChannelLayout {
  const joints = chainJoints(hands);
  return createLayout(
    joints.map(() => PRIOR_CHANNEL),
    joints.map(([, place], joint) => (place > 0 ? joint - 1 : -1)),
    joints.map((_, joint) => joint - 1),
    { scaleOffsets: toScales(offsets, joints.length) },
  );
}

/** Returns the inverses [E][3][3] of the weights: the distance of the finger's tip, the same about all axes. */
export function inverseFingerWeights(hands: Hands): Float64Array {
  const joints = chainJoints(hands);
  const inverses = new Float64Array(joints.length * 9);
  joints.forEach(([chain, place], joint) => {
    const from = chain * MAX_CHAIN_JOINTS;
    const length = hands.lengths
      .subarray(from + place, from + hands.counts[chain])
      .reduce((sum, bone) => sum + bone, 0);
    for (let i = 0; i < 3; i++) inverses[joint * 9 + i * 4] = 1 / Math.hypot(length, TWIST_RADIUS_M);
  });
  return inverses;
}
