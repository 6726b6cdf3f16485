/** Distribution of a performer's finger joints over the bones of an avatar, which may have fewer of both. */
import { chainJoints, FINGERS, type Hands } from "../../motion/hands";

/** Part of a bone's rotation: the mean rotation vector of joints, times a share. */
export interface JointTurn {
  readonly joints: readonly number[];
  readonly share: number;
}

/**
 * Return the rotations, one after the other, of each of `boneCount` bones of a chain. The last bone stands for all
 * joints that have none: it lies along the mean of their directions. A finger that the performer lacks moves as its
 * nearest neighbour, a mitten as all fingers do.
 */
export function planChain(hands: Hands, chain: number, boneCount: number, isMitten: boolean): JointTurn[][] {
  const sources = findSources(hands, chain, isMitten);
  if (sources.length === 0) return [];
  const starts = sources.map((source) => chainJoints(hands).findIndex(([one]) => one === source));
  const count = Math.min(...sources.map((source) => hands.counts[source]));
  return Array.from({ length: boneCount }, (_, bone) => {
    const end = bone === boneCount - 1 ? Math.max(count, bone + 1) : bone + 1;
    const turns: JointTurn[] = [];
    for (let place = bone; place < Math.min(end, count); place++)
      turns.push({ joints: starts.map((start) => start + place), share: (end - place) / (end - bone) });
    return turns;
  });
}

/** Return the chains of the performer that a chain of the avatar moves with. */
function findSources({ counts }: Hands, chain: number, isMitten: boolean): number[] {
  const finger = chain % FINGERS.length;
  const fingers = FINGERS.flatMap((_, other) => (other > 0 && counts[chain - finger + other] > 0 ? [other] : []));
  if (finger === 0) return counts[chain] > 0 ? [chain] : [];
  if (isMitten) return fingers.map((other) => chain - finger + other);
  fingers.sort((a, b) => Math.abs(a - finger) - Math.abs(b - finger));
  return fingers.slice(0, 1).map((other) => chain - finger + other);
}
