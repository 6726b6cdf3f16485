/** Names of joints: their words, their sides, and how the names of one skeleton are spelled. */
import { isDescendant } from "./joint-tree";
import { type NamingProfile, SIDE_WORDS, type SideWords } from "./naming-profile";

const WORD = /[A-Z]+(?![a-z])|[A-Z]?[a-z]+|\p{Nd}+|(?:(?![A-Za-z\p{Nd}])[\p{L}\p{N}])+/gu;
const JOINT_NUMBER = /_[0-9]+$/;
/** Precedes the side in a key for a name that was divided into side and rest; no normalised name contains it. */
const SIDE_MARK = "/";
/** Share of the names from which on numbers at their ends are those of the joints, not of the words. */
const MIN_NUMBERED_SHARE = 0.8;
/** Spellings that are tried for each profile, those with the shortest prefix and suffix first. */
const MAX_SPELLINGS = 64;

/** Return a name without namespace, case and punctuation: "rig:upper_arm.L" -> "upperarml". */
export function normaliseName(name: string): string {
  return stripNamespace(name)
    .toLowerCase()
    .replace(/[^\p{L}\p{N}]/gu, "");
}

/** Return the words of a name without namespace, in lower case: "rig:upperArm_01.L" -> upper, arm, 01, l. */
export function splitWords(name: string): string[] {
  return (stripNamespace(name).match(WORD) ?? []).map((word) => word.toLowerCase());
}

/**
 * Return names without the number of the joint that converters append: "LeftArm_012" -> "LeftArm"; null if few of them
 * have one.
 */
export function stripNumbers(names: readonly string[]): string[] | null {
  const stripped = names.map((name) => name.replace(JOINT_NUMBER, ""));
  const count = stripped.filter((name, joint) => name !== names[joint]).length;
  return count > 0 && count >= MIN_NUMBERED_SHARE * names.length ? stripped : null;
}

function stripNamespace(name: string): string {
  return (
    name
      .normalize("NFKC")
      .trim()
      .replace(/[:|]+$/, "")
      .split(/[:|]/)
      .at(-1) ?? ""
  );
}

/** Return the words for a side that are a word of the name, begin or end it, each with the rest of the name. */
function splitSide(name: string): Set<string> {
  const plain = normaliseName(name);
  const words = splitWords(name);
  const found = new Set<string>();
  for (const side of SIDE_WORDS.flat()) {
    const add = (rest: string) => found.add(`${SIDE_MARK}${side}${SIDE_MARK}${rest}`);
    if (plain.startsWith(side)) add(plain.slice(side.length));
    if (plain.endsWith(side)) add(plain.slice(0, plain.length - side.length));
    const at = words.indexOf(side);
    if (at >= 0) add(words.toSpliced(at, 1).join(""));
  }
  return found;
}

/** Joints by normalised name, and by side and rest of the name where the name can be divided so. */
export class NameIndex {
  readonly #joints = new Map<string, number[]>();

  constructor(
    names: readonly string[],
    readonly parents: readonly number[],
  ) {
    names.forEach((name, joint) => {
      for (const key of [normaliseName(name), ...splitSide(name)]) {
        const joints = this.#joints.get(key);
        if (joints) joints.push(joint);
        else this.#joints.set(key, [joint]);
      }
    });
  }

  /** Return the keys that begin with `lead`, without it; those without a mark if it is empty. */
  keysAfter(lead: string): string[] {
    const keys = [...this.#joints.keys()];
    return lead
      ? keys.filter((key) => key.startsWith(lead)).map((key) => key.slice(lead.length))
      : keys.filter((key) => !key.startsWith(SIDE_MARK));
  }

  /** Return whether a regular expression matches a whole key. */
  hasName(pattern: string): boolean {
    const whole = new RegExp(`^(?:${pattern})$`, "u");
    return [...this.#joints.keys()].some((key) => whole.test(key));
  }

  /** Return the first joint with `key` that is below `above`, if given, and not in `used`; undefined if none is. */
  find(key: string, above: number | null, used: ReadonlySet<number>): number | undefined {
    return this.#joints
      .get(key)
      ?.find((joint) => !used.has(joint) && (above === null || isDescendant(this.parents, joint, above)));
  }
}

/**
 * Places of the side in the names of a skeleton: at the beginning or end, or a separate word in the middle; directly
 * before or after a profile's pattern.
 */
const SIDE_PLACES = ["apart", "before", "after"] as const;
type SidePlace = (typeof SIDE_PLACES)[number];

/** Spelling of a skeleton's names: words for the sides and their place, prefix and suffix of all names. */
export class Spelling {
  constructor(
    readonly words: SideWords,
    readonly place: SidePlace,
    readonly prefix: string,
    readonly suffix: string,
  ) {}

  /** Return the key in a `NameIndex` of a pattern on the left (0) or right (1). */
  limbKey(side: number, pattern: string): string {
    const [lead, core] = keyParts(this.place, this.words[side], pattern);
    return lead + this.prefix + core + this.suffix;
  }

  /** Return the key in a `NameIndex` of a pattern without side. */
  trunkKey(pattern: string): string {
    return this.prefix + pattern + this.suffix;
  }
}

/** Return what a key begins with, and what follows after the common prefix of all names. */
function keyParts(place: SidePlace, side: string, pattern: string): readonly [lead: string, core: string] {
  if (place === "apart") return [`${SIDE_MARK}${side}${SIDE_MARK}`, pattern];
  return ["", place === "before" ? side + pattern : pattern + side];
}

/** Return the spellings in which a name of the skeleton is the profile's left knee, or another joint of a side. */
export function findSpellings(profile: NamingProfile, index: NameIndex, joint = "knee", side = 0): Spelling[] {
  const found = new Map<string, Spelling>();
  for (const words of SIDE_WORDS)
    for (const place of SIDE_PLACES)
      for (const pattern of profile.limbs[joint].split("|")) {
        const [lead, core] = keyParts(place, words[side], pattern);
        for (const key of index.keysAfter(lead)) {
          const at = key.indexOf(core);
          if (at < 0) continue;
          const spelling = new Spelling(words, place, key.slice(0, at), key.slice(at + core.length));
          found.set([words[0], place, spelling.prefix, spelling.suffix].join("\n"), spelling);
        }
      }
  return [...found.values()].sort(compareSpellings).slice(0, MAX_SPELLINGS);
}

function compareSpellings(a: Spelling, b: Spelling): number {
  return (
    a.prefix.length + a.suffix.length - b.prefix.length - b.suffix.length ||
    SIDE_WORDS.indexOf(a.words) - SIDE_WORDS.indexOf(b.words) ||
    SIDE_PLACES.indexOf(a.place) - SIDE_PLACES.indexOf(b.place) ||
    compareTexts(a.prefix, b.prefix) ||
    compareTexts(a.suffix, b.suffix)
  );
}

function compareTexts(a: string, b: string): number {
  return a < b ? -1 : a > b ? 1 : 0;
}
