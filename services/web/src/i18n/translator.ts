/**
 * Translation of texts. The English text is the key and the default. Translations are loaded before the page is built,
 * so modules must not translate while they load: tables hold English texts, which are translated where they are shown.
 * The page has one translator, each embedded element has its own. Pure.
 */
import { isolateBidi } from "./bidi";
import type { JAPANESE_PAGE_MESSAGES } from "./japanese";

export type Language = "en" | "ja";

/** English text of the page. A `{name}` in it is a placeholder for a value. */
export type MessageKey = keyof typeof JAPANESE_PAGE_MESSAGES;

/** Names of a text's placeholders. */
type PlaceholderNames<Text> = Text extends `${string}{${infer Name}}${infer Rest}`
  ? Name | PlaceholderNames<Rest>
  : never;

/** English text without placeholders. */
export type PlainMessageKey = {
  [Text in MessageKey]: [PlaceholderNames<Text>] extends [never] ? Text : never;
}[MessageKey];

/** Translations by English text: texts of the page, and texts that the server sends. */
export interface LocaleMessages {
  readonly page: Readonly<Record<string, string>>;
  readonly server: Readonly<Record<string, string>>;
}

const NO_MESSAGES: LocaleMessages = { page: {}, server: {} };

/** Translator to one language. Its functions may be detached: `const { translate } = translator`. */
export class Translator {
  #language: Language = "en";
  #messages = NO_MESSAGES;

  constructor(language: Language = "en", messages = NO_MESSAGES) {
    this.setLanguage(language, messages);
  }

  /** Language tag, also for `lang` attributes and `Intl`. */
  get language(): Language {
    return this.#language;
  }

  setLanguage(language: Language, messages = NO_MESSAGES): void {
    [this.#language, this.#messages] = [language, messages];
  }

  /** Translate a text and fill in its values, which may be names in another direction of writing. */
  readonly translate = <Text extends MessageKey>(
    english: Text,
    ...values: [PlaceholderNames<Text>] extends [never] ? [] : [Record<PlaceholderNames<Text>, string | number>]
  ): string => interpolate(this.#messages.page[english] ?? english, isolateValues(values[0] ?? {})).join("");

  /** Translate a text whose values are not strings, such as elements; return its parts in order. */
  readonly translateToParts = <Text extends MessageKey, Values extends Record<PlaceholderNames<Text>, unknown>>(
    english: Text,
    values: Values,
  ): (string | Values[keyof Values])[] =>
    interpolate(this.#messages.page[english] ?? english, values as Record<string, Values[keyof Values]>);

  /** Join items to a list within a sentence. */
  readonly joinList = (items: readonly string[]): string => items.join(this.translate(", "));

  /** Translate a text that the server sent, if there is a translation; values in it are translated too. */
  readonly translateServerText = (text: string): string => {
    const { server } = this.#messages;
    const exact = server[text];
    if (exact !== undefined) return exact;
    for (const [english, translated] of Object.entries(server)) {
      if (!english.includes("{")) continue;
      const values = templatePattern(english).exec(text)?.groups;
      if (values)
        return interpolate(
          translated,
          isolateValues(Object.fromEntries(Object.entries(values).map(([name, one]) => [name, server[one] ?? one]))),
        ).join("");
    }
    return text;
  };
}

/** Translator of the page. */
export const pageTranslator = new Translator();

/** Functions of the page's translator. */
export const { translate, translateToParts, joinList, translateServerText } = pageTranslator;
export const pageLanguage = (): Language => pageTranslator.language;
export const setPageLanguage: Translator["setLanguage"] = (language, messages) =>
  pageTranslator.setLanguage(language, messages);

function interpolate<Value>(text: string, values: Readonly<Record<string, Value>>): (string | Value)[] {
  return text.split(/\{(\w+)\}/).map((part, i) => (i % 2 === 0 ? part : values[part]));
}

function isolateValues(values: Readonly<Record<string, string | number>>): Record<string, string | number> {
  return Object.fromEntries(
    Object.entries(values).map(([name, value]) => [name, typeof value === "string" ? isolateBidi(value) : value]),
  );
}

/** Return a pattern that matches a text with its placeholders filled in, with one named group per placeholder. */
function templatePattern(english: string): RegExp {
  const pattern = english
    .split(/\{(\w+)\}/)
    .map((part, i) => (i % 2 === 0 ? part.replace(/[.*+?^${}()|[\]\\]/g, "\\$&") : `(?<${part}>.+)`));
  return new RegExp(`^${pattern.join("")}$`, "s");
}
