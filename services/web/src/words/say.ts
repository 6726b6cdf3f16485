/**
 * What is said to people, in a language. English is the key and the default; another language's words are learnt before the page is made, so nothing is
 * said while modules load: tables hold the English, and `say` is called where they are shown. The page has one speech, an element in another site's page its
 * own each. Pure.
 */
import type { JAPANESE } from "./japanese";

export type Language = "en" | "ja";

/** A text that the page has. A `{name}` in it stands for a value. */
export type English = keyof typeof JAPANESE;

/** The names of a text's values. */
type Names<Text> = Text extends `${string}{${infer Name}}${infer Rest}` ? Name | Names<Rest> : never;

/** A text without values, as tables have it. */
export type Plain = { [Text in English]: [Names<Text>] extends [never] ? Text : never }[English];

/** The words of a language other than English, by the English: `said` by the page, and `heard` from the server. */
export interface Words {
  readonly said: Readonly<Record<string, string>>;
  readonly heard: Readonly<Record<string, string>>;
}

const NONE: Words = { said: {}, heard: {} };

/** How one language is spoken. What it says with may be called without it: `const { say } = speech`. */
export class Speech {
  #language: Language = "en";
  #words = NONE;

  constructor(language: Language = "en", words = NONE) {
    this.speak(language, words);
  }

  /** The language, also for `lang` and `Intl`. */
  get language(): Language {
    return this.#language;
  }

  /** Speaks a language from now on. */
  speak(language: Language, words = NONE): void {
    [this.#language, this.#words] = [language, words];
  }

  /** A text in this language. */
  readonly say = <Text extends English>(english: Text, ...values: [Names<Text>] extends [never] ? [] : [Record<Names<Text>, string | number>]): string =>
    filled(this.#words.said[english] ?? english, values[0] ?? {}).join("");

  /** A text around things that are none, in their order: elements within a sentence. */
  readonly sayAround = <Text extends English, Things extends Record<Names<Text>, unknown>>(english: Text, values: Things): (string | Things[keyof Things])[] =>
    filled(this.#words.said[english] ?? english, values as Record<string, Things[keyof Things]>);

  /** Things one after another, as in a sentence. */
  readonly series = (things: readonly string[]): string => things.join(this.say(", "));

  /** What the server says, in this language where that has words for it; else as it came. */
  readonly heard = (text: string): string => {
    const { heard } = this.#words;
    const exact = heard[text];
    if (exact !== undefined) return exact;
    for (const [english, own] of Object.entries(heard)) {
      if (!english.includes("{")) continue;
      const values = matcher(english).exec(text)?.groups;
      if (values) return filled(own, Object.fromEntries(Object.entries(values).map(([name, value]) => [name, heard[value] ?? value]))).join("");
    }
    return text;
  };
}

/** The page's own. */
export const pageSpeech = new Speech();

/** As `Speech` has them, for the page. */
export const { say, sayAround, series, heard } = pageSpeech;
export const language = (): Language => pageSpeech.language;
export const speak: Speech["speak"] = (now, words) => pageSpeech.speak(now, words);

function filled<Thing>(text: string, values: Readonly<Record<string, Thing>>): (string | Thing)[] {
  return text.split(/\{(\w+)\}/).map((part, i) => (i % 2 === 0 ? part : values[part]));
}

/** What a text with values looks like once they are in it. */
function matcher(english: string): RegExp {
  const pattern = english.split(/\{(\w+)\}/).map((part, i) => (i % 2 === 0 ? part.replace(/[.*+?^${}()|[\]\\]/g, "\\$&") : `(?<${part}>.+)`));
  return new RegExp(`^${pattern.join("")}$`, "s");
}
