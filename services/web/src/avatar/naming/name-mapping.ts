/** Mapping of a skeleton's joints to H-Anim joints by their names. */
import { findSpellings, NameIndex, type Spelling, splitWords, stripNumbers } from "./joint-name";
import { ancestorChain } from "./joint-tree";
import { ARM_JOINTS, LEG_JOINTS, type NamingProfile, PROFILES } from "./naming-profile";

/** Limb joints that a profile must match on both sides. */
const REQUIRED_LIMB_JOINTS: ReadonlySet<string> = new Set(["hip", "knee", "shoulder", "elbow"]);
const HEAD_WORDS: ReadonlySet<string | undefined> = new Set(["head", "頭"]);

/** Share of the limb joints from which on a skeleton is a body with parts missing. */
const MIN_PARTIAL_SHARE = 0.4;

/** Joint index for each H-Anim joint name, and the naming convention that gave them. */
export interface JointMapping {
  readonly profile: string;
  readonly joints: ReadonlyMap<string, number>;
}

/**
 * Return the mapping of the profile that matches most joints, or null if none matches both arms and legs. If none does
 * and most names end in a number of their own, as "LeftArm_012", they are compared without it.
 */
export function mapByName(names: readonly string[], parents: readonly number[]): JointMapping | null {
  const found = mapNames(names, parents);
  const stripped = found ? null : stripNumbers(names);
  return stripped ? mapNames(stripped, parents) : found;
}

/**
 * Return the joints of the profile that matches most, though arms or legs are incomplete; empty if it matches too few
 * of the limbs.
 */
export function mapPartly(names: readonly string[], parents: readonly number[]): ReadonlyMap<string, number> {
  const limbCount = 2 * (LEG_JOINTS.length + ARM_JOINTS.length);
  let best: ReadonlyMap<string, number> = new Map();
  for (const spelled of [names, stripNumbers(names)]) {
    if (!spelled) continue;
    const index = new NameIndex(spelled, parents);
    for (const profile of PROFILES.filter(({ marker }) => !marker || index.hasName(marker)))
      for (const joint of REQUIRED_LIMB_JOINTS)
        for (const side of [0, 1])
          for (const spelling of findSpellings(profile, index, joint, side)) {
            const joints = matchProfile(profile, spelling, index, true);
            if (joints.size > best.size) best = joints;
          }
  }
  const limbs = [...best.keys()].filter((joint) => /^[lr]_/.test(joint));
  return limbs.length >= MIN_PARTIAL_SHARE * limbCount ? best : new Map();
}

/** Return the first joint that is named as a head and is in none of the limbs in `joints`; undefined if none is. */
export function findHeadByName(
  names: readonly string[],
  parents: readonly number[],
  joints: ReadonlyMap<string, number>,
): number | undefined {
  const limbs = ["l", "r"].flatMap((side) => ["hip", "shoulder"].map((joint) => joints.get(`${side}_${joint}`)));
  const found = names.findIndex((name, joint) => {
    if (!HEAD_WORDS.has(splitWords(name).at(-1))) return false;
    const above = ancestorChain(parents, joint);
    return !limbs.some((limb) => limb !== undefined && above.includes(limb));
  });
  return found < 0 ? undefined : found;
}

function mapNames(names: readonly string[], parents: readonly number[]): JointMapping | null {
  const index = new NameIndex(names, parents);
  let best: JointMapping | null = null;
  let bestScore: readonly number[] = [];
  for (const profile of PROFILES) {
    const isMarked = profile.marker !== "" && index.hasName(profile.marker);
    if (profile.marker && !isMarked) continue;
    for (const spelling of findSpellings(profile, index)) {
      const joints = matchProfile(profile, spelling, index);
      const score = [joints.size, Number(isMarked), Number(spelling.words.join() === profile.sideWords.join())];
      if (joints.size === 0 || (best && !isHigher(score, bestScore))) continue;
      best = { profile: profile.name, joints };
      bestScore = score;
    }
  }
  return best;
}

/** Return whether the first number that differs is higher. */
function isHigher(score: readonly number[], other: readonly number[]): boolean {
  const at = score.findIndex((value, k) => value !== other[k]);
  return at >= 0 && score[at] > other[at];
}

/**
 * Return the joints of a profile, each below the previous one of its limb; empty if an arm or leg is incomplete, unless
 * `allowsGaps`. The end of a limb may have the same name on both sides, as it is below joints of one side.
 */
function matchProfile(
  profile: NamingProfile,
  spelling: Spelling,
  index: NameIndex,
  allowsGaps = false,
): Map<string, number> {
  const joints = new Map<string, number>();
  const used = new Set<number>();
  const findAny = (keys: readonly string[], above: number | null) => {
    for (const key of keys) {
      const found = index.find(key, above, used);
      if (found !== undefined) return found;
    }
    return undefined;
  };
  const add = (name: string, joint: number) => {
    joints.set(name, joint);
    used.add(joint);
  };
  for (const [side, letter] of ["l", "r"].entries())
    for (const chain of [LEG_JOINTS, ARM_JOINTS]) {
      let above: number | null = null;
      for (const joint of chain) {
        const patterns = profile.limbs[joint].split("|");
        const isRequired = REQUIRED_LIMB_JOINTS.has(joint);
        const keys = patterns.map((pattern) => spelling.limbKey(side, pattern));
        if (!isRequired) keys.push(...patterns.map((pattern) => spelling.trunkKey(pattern)));
        const found = findAny(keys, above);
        if (found === undefined && isRequired && !allowsGaps) return new Map();
        if (found === undefined) continue;
        add(`${letter}_${joint}`, found);
        above = found;
      }
    }
  for (const [joint, pattern] of Object.entries(profile.trunk)) {
    const patterns = pattern.split("|");
    const found = findAny([...patterns.map((one) => spelling.trunkKey(one)), ...patterns], null);
    if (found !== undefined) add(joint, found);
  }
  return joints;
}
