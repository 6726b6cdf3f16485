/**
 * What is said to people, in a language. English is the key and the default; another language's words are learnt before the page is made, so nothing is
 * said while modules load: tables hold the English, and `say` is called where they are shown. The page has one speech, an element in another site's page its
 * own each. Pure.
 */
import type { JAPANESE_PAGE_MESSAGES } from "./japanese";

export type Language = "en" | "ja";

/** A text that the page has. A `{name}` in it stands for a value. */
export type MessageKey = keyof typeof JAPANESE_PAGE_MESSAGES;

/** The names of a text's values. */
type PlaceholderNames<Text> = Text extends `${string}{${infer Name}}${infer Rest}`
  ? Name | PlaceholderNames<Rest>
  : never;

/** A text without values, as tables have it. */
export type PlainMessageKey = {
  [Text in MessageKey]: [PlaceholderNames<Text>] extends [never] ? Text : never;
}[MessageKey];

/** The words of a language other than English, by the English: `said` by the page, and `heard` from the server. */
export interface LocaleMessages {
  readonly page: Readonly<Record<string, string>>;
  readonly server: Readonly<Record<string, string>>;
}

const NO_MESSAGES: LocaleMessages = { page: {}, server: {} };

/** How one language is spoken. What it says with may be called without it: `const { say } = speech`. */
export class Translator {
  #language: Language = "en";
  #messages = NO_MESSAGES;

  constructor(language: Language = "en", words = NO_MESSAGES) {
    this.setLanguage(language, words);
  }

  /** The language, also for `lang` and `Intl`. */
  get language(): Language {
    return this.#language;
  }

  /** Speaks a language from now on. */
  setLanguage(language: Language, messages = NO_MESSAGES): void {
    [this.#language, this.#messages] = [language, messages];
  }

  /** A text in this language. */
  readonly translate = <Text extends MessageKey>(
    english: Text,
    ...values: [PlaceholderNames<Text>] extends [never] ? [] : [Record<PlaceholderNames<Text>, string | number>]
  ): string => interpolate(this.#messages.page[english] ?? english, values[0] ?? {}).join("");

  /** A text around things that are none, in their order: elements within a sentence. */
  readonly translateToParts = <Text extends MessageKey, Things extends Record<PlaceholderNames<Text>, unknown>>(
    english: Text,
    values: Things,
  ): (string | Things[keyof Things])[] =>
    interpolate(this.#messages.page[english] ?? english, values as Record<string, Things[keyof Things]>);

  /** Things one after another, as in a sentence. */
  readonly joinList = (things: readonly string[]): string => things.join(this.translate(", "));

  /** What the server says, in this language where that has words for it; else as it came. */
  readonly translateServerText = (text: string): string => {
    const { server: heard } = this.#messages;
    const exact = heard[text];
    if (exact !== undefined) return exact;
    for (const [english, own] of Object.entries(heard)) {
      if (!english.includes("{")) continue;
      const values = templatePattern(english).exec(text)?.groups;
      if (values)
        return interpolate(
          own,
          Object.fromEntries(Object.entries(values).map(([name, value]) => [name, heard[value] ?? value])),
        ).join("");
    }
    return text;
  };
}

/** The page's own. */
export const pageTranslator = new Translator();

/** As `Speech` has them, for the page. */
export const { translate, translateToParts, joinList, translateServerText } = pageTranslator;
export const pageLanguage = (): Language => pageTranslator.language;
export const setPageLanguage: Translator["setLanguage"] = (now, words) => pageTranslator.setLanguage(now, words);

function interpolate<Thing>(text: string, values: Readonly<Record<string, Thing>>): (string | Thing)[] {
  return text.split(/\{(\w+)\}/).map((part, i) => (i % 2 === 0 ? part : values[part]));
}

/** What a text with values looks like once they are in it. */
function templatePattern(english: string): RegExp {
  const pattern = english
    .split(/\{(\w+)\}/)
    .map((part, i) => (i % 2 === 0 ? part.replace(/[.*+?^${}()|[\]\\]/g, "\\$&") : `(?<${part}>.+)`));
  return new RegExp(`^${pattern.join("")}$`, "s");
}
