/**
 * Fingers of a plain glTF file, by the names of the joints below a hand. The words and rules are those of the server's
 * readers of motions (`bunraku.motion.naming.finger_mapping`).
 */
import document from "../../../../../proto/hand_face_names.json";
import { FINGERS, MAX_CHAIN_JOINTS } from "../../motion/hands";
import { splitWords, stripNumbers } from "../naming/joint-name";

const { words: FINGER_WORDS, mitten: MITTEN_FINGER, ordinals: ORDINALS, ...patterns } = document.fingers;
const THUMB = FINGERS.indexOf("thumb");
/** Joints of a finger that are looked at: a metacarpal bone, three joints, a tip, and one to spare. */
const MAX_PATH_JOINTS = 6;
/** Digits of a number that are read. */
const MAX_DIGITS = 4;

const wholeWord = (pattern: string) => new RegExp(`^(?:${pattern})$`);
const PARTS = [patterns.palm, patterns.last, patterns.tip, patterns.middle].join("|");
const FINGER_GROUPS = FINGER_WORDS.map((words) => `(${words})`).join("|");
const NAMED = wholeWord(
  `(?:${patterns.side})?(?<palm>inhand)?(?:hand)?(?:f|finger)?(?:${FINGER_GROUPS})` +
    `(?:finger|指)?(?<part>${PARTS})?(?:${patterns.side})?`,
);
const NUMBERED = wholeWord(`(?:${patterns.side})?(?:hand)?(?:finger|digit|指)`);
const HANIM = wholeWord("carpometacarpal|metacarpophalangeal|interphalangeal");
const PART = wholeWord(PARTS);
const [PALM, TIP, OTHER] = [patterns.palm, patterns.tip, patterns.other].map(wholeWord);

/** Part of a hand that a joint's bone is: a metacarpal bone, or no bone but the end of the last one. */
type FingerPart = "palm" | "tip" | "bone";

/** What the name of a joint says about a finger. */
interface FingerName {
  /** Place in `FINGERS`, null if the name only has the file's own number of it. */
  readonly finger: number | null;
  readonly number: number | null;
  readonly part: FingerPart;
  /** Number of the joint in its finger, null if it has none. */
  readonly jointNumber: number | null;
}

/**
 * Return the joints of each finger below a hand, thumb first, each from the wrist outwards and at most three; a finger
 * that is not named has none.
 */
export function findFingers(names: readonly string[], parents: readonly number[], hand: number): number[][] {
  const children = new Map<number, number[]>([[hand, []]]);
  for (let joint = hand + 1; joint < parents.length; joint++) {
    const siblings = children.get(parents[joint]);
    if (!siblings) continue;
    siblings.push(joint);
    children.set(joint, []);
  }
  const joints = [...children.keys()].slice(1);
  const named = parseNames(names, joints);
  const paths = findPaths(named, joints, parents, children);
  return FINGERS.map((_, finger) => dividePath(finger, paths.get(finger) ?? [], named, children));
}

type NamedJoints = ReadonlyMap<number, FingerName>;
type Children = ReadonlyMap<number, readonly number[]>;

/** Return what names say about fingers; if that is nothing, without the joints' own numbers at their ends. */
function parseNames(names: readonly string[], joints: readonly number[]): NamedJoints {
  for (const known of [names, stripNumbers(names)]) {
    const found = new Map<number, FingerName>();
    for (const joint of known ? joints : []) {
      const name = parseFingerName((known as readonly string[])[joint]);
      if (name) found.set(joint, name);
    }
    if (found.size > 0) return found;
  }
  return new Map();
}

/** Return what a name says about a finger, null if it names none. Words for sides do not matter. */
function parseFingerName(name: string): FingerName | null {
  const words = splitWords(name)
    .join(" ")
    .replace(/\bfore finger\b/, "forefinger")
    .split(" ");
  if (words.some((word) => OTHER.test(word))) return null;
  const numbersIn = (some: readonly string[]) =>
    some.filter(isNumber).map((digits) => Number(digits.slice(0, MAX_DIGITS)));
  const hanim = words.find((word) => HANIM.test(word));
  if (hanim !== undefined) {
    const number = numbersIn(words).at(-1) ?? 0;
    if (number < 1 || number > FINGERS.length) return null;
    const part = hanim === "carpometacarpal" ? "palm" : "bone";
    return { finger: number - 1, number: null, part, jointNumber: null };
  }
  const part = findPart(words);
  for (const [place, word] of words.entries()) {
    const rest = words.slice(place + 1);
    const [first = null, second = null] = numbersIn(rest);
    const match = word === "midcarpal" ? null : NAMED.exec(word);
    if (match) {
      // The groups of the fingers follow that of the palm.
      const finger = match.slice(2).findIndex((found) => found !== undefined);
      const own = findPart([match.groups?.["palm"] ?? "", match.groups?.["part"] ?? ""]);
      return { finger, number: null, part: part === "bone" ? own : part, jointNumber: first };
    }
    if (word === "finger" && rest[0] === "base")
      return { finger: MITTEN_FINGER, number: null, part: "bone", jointNumber: null };
    if (isNumber(rest[0] ?? "") && NUMBERED.test(word))
      return { finger: null, number: first, part, jointNumber: second };
    if (ORDINALS.includes(word) && PART.test(rest.join("")))
      return { finger: ORDINALS.indexOf(word), number: null, part, jointNumber: null };
  }
  return null;
}

function isNumber(word: string): boolean {
  return /^[0-9]+$/.test(word);
}

/** Return the part that the words of a name say; a tip before all, as in "distal_end". */
function findPart(words: readonly string[]): FingerPart {
  if (words.some((word) => TIP.test(word))) return "tip";
  return words.join("").includes("inhand") || words.some((word) => PALM.test(word)) ? "palm" : "bone";
}

/** Return the longest path of joints of each finger that names tell. */
function findPaths(
  named: NamedJoints,
  joints: readonly number[],
  parents: readonly number[],
  children: Children,
): Map<number, readonly number[]> {
  const within = new Set(named.keys());
  for (const joint of joints) if (within.has(parents[joint])) within.add(joint);
  const roots = [...named].filter(([joint]) => !within.has(parents[joint]));
  // Numbers start at the thumb, or after a thumb that has its name.
  const startsAtZero = roots.some(([, { finger, number }]) => finger === null && number === 0);
  const hasThumb = roots.some(([, { finger }]) => finger === THUMB);
  const start = (startsAtZero ? 0 : 1) - (hasThumb ? 1 : 0);
  const longest = longestPaths(named, children);
  const paths = new Map<number, readonly number[]>();
  for (const [root, { finger, number }] of roots) {
    const place = finger ?? (number ?? 0) - start;
    const path = longest.get(root) ?? [];
    if (path.length > (paths.get(place)?.length ?? 0)) paths.set(place, path);
  }
  return paths;
}

/** Return the longest path down named joints from each of them; the joint at its end may have any name. */
function longestPaths(named: NamedJoints, children: Children): Map<number, readonly number[]> {
  const childrenOf = (joint: number) => children.get(joint) ?? [];
  const paths = new Map<number, readonly number[]>();
  for (const joint of [...named.keys()].reverse()) {
    const below = childrenOf(joint).flatMap((child) => {
      const path = paths.get(child);
      return path ? [path] : [];
    });
    const [only, ...others] = childrenOf(joint);
    if (below.length === 0 && only !== undefined && others.length === 0 && childrenOf(only).length === 0)
      below.push([only]);
    const longest = below.reduce((a, b) => (b.length > a.length ? b : a), []);
    paths.set(joint, [joint, ...longest].slice(0, MAX_PATH_JOINTS));
  }
  return paths;
}

/** Return the joints of a finger on its path, without those of the palm and the tip. */
function dividePath(finger: number, path: readonly number[], named: NamedJoints, children: Children): number[] {
  const joints = [...path];
  const last = joints.at(-1);
  if (last === undefined) return [];
  const isTip = (named.get(last)?.part ?? "tip") === "tip";
  if (isTip && children.get(last)?.length === 0) joints.pop();
  const isInPalm = (joint: number) => {
    const name = named.get(joint);
    return name?.part === "palm" || (joints.length > MAX_CHAIN_JOINTS && name?.jointNumber === 0);
  };
  while (finger !== THUMB && joints.length > 0 && isInPalm(joints[0])) joints.shift();
  return joints.slice(0, MAX_CHAIN_JOINTS);
}
