/**
 * Names of expressions and morph targets, as avatars spell those of a performer's face. The rules and the aliases are
 * those of the server's readers of motions (`bunraku.motion.naming.expression_mapping`): names of ARKit in any case,
 * with any separators, after prefixes, and with "_L" and "_R"; common words, like those of VRM, only as whole names.
 */
import document from "../../../../../proto/hand_face_names.json";
import { EXPRESSIONS, GAZE } from "../../motion/face";

/** Characters and words of a name that are looked at, from its end. */
const MAX_NAME_CHARACTERS = 200,
  MAX_NAME_WORDS = 12;

const { suffixes, whole } = document.expressions;
const lowerCase = (names: readonly string[]) => names.map((name): [string, string] => [name.toLowerCase(), name]);
const FIRST_OF_VRM = EXPRESSIONS.indexOf("happy");
const BY_SUFFIX = new Map(
  [...lowerCase(EXPRESSIONS.slice(0, FIRST_OF_VRM)), ...Object.entries(suffixes)].flatMap(([key, name]) => {
    const short = key.replace(/(left|right)$/, (side) => side[0]);
    return short === key
      ? [[key, name]]
      : ([
          [key, name],
          [short, name],
        ] as [string, string][]);
  }) as [string, string][],
);
const BY_WHOLE = new Map([
  ...lowerCase(EXPRESSIONS.slice(FIRST_OF_VRM).filter((name) => !GAZE.includes(name))),
  ...Object.entries(whole),
]);
const SIDES: Readonly<Record<string, string>> = { l: "left", r: "right" };

/** Return the expression of a face that a name of an avatar means, or null if it is none. */
export function expressionOfName(name: string): string | null {
  const plain = [...name].slice(-MAX_NAME_CHARACTERS).join("").normalize("NFKC");
  for (const part of [plain, plain.split(/[:|.]/).at(-1) ?? ""]) {
    const found = BY_WHOLE.get(splitName(part).join(""));
    if (found) return found;
  }
  const words = splitName(plain).slice(-MAX_NAME_WORDS);
  for (let start = 0; start < words.length; start++) {
    const found = BY_SUFFIX.get(words.slice(start).join(""));
    if (found) return found;
  }
  return null;
}

/** Return the words of a name in lower case, with the side at the end as a whole word. */
function splitName(name: string): string[] {
  const words = name
    .replace(/([a-z])(?=[A-Z])/g, "$1 ")
    .toLowerCase()
    .split(/[^\p{L}\p{N}]+/u)
    .filter(Boolean);
  const last = words.at(-1) ?? "";
  if (words.length > 1) words[words.length - 1] = SIDES[last] ?? last;
  return words;
}

/** Return whether a name is that of an expression itself, not an alias. */
export function isExactName(name: string): boolean {
  return EXPRESSIONS.some((expression) => expression.toLowerCase() === name.toLowerCase());
}
