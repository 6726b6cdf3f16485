/**
 * What the page says to people, in its language. English is the key and the default; another language's words are learnt before the page is made, so nothing is
 * said while modules load: tables hold the English, and `say` is called where they are shown. Pure.
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

let spoken: Language = "en";
let words: Words = { said: {}, heard: {} };

/** The language of the page, also for `Intl`. */
export function language(): Language {
  return spoken;
}

/** Speaks a language from now on. */
export function speak(now: Language, known: Words = { said: {}, heard: {} }): void {
  [spoken, words] = [now, known];
}

/** A text in the page's language. */
export function say<Text extends English>(english: Text, ...values: [Names<Text>] extends [never] ? [] : [Record<Names<Text>, string | number>]): string {
  return filled(words.said[english] ?? english, values[0] ?? {}).join("");
}

/** A text around things that are none, in their order: elements within a sentence. */
export function sayAround<Text extends English, Things extends Record<Names<Text>, unknown>>(english: Text, values: Things): (string | Things[keyof Things])[] {
  return filled(words.said[english] ?? english, values as Record<string, Things[keyof Things]>);
}

/** Things one after another, as in a sentence. */
export function series(things: readonly string[]): string {
  return things.join(say(", "));
}

/** What the server says, in the page's language where that has words for it; else as it came. */
export function heard(text: string): string {
  const exact = words.heard[text];
  if (exact !== undefined) return exact;
  for (const [english, own] of Object.entries(words.heard)) {
    if (!english.includes("{")) continue;
    const values = matcher(english).exec(text)?.groups;
    if (values) return filled(own, Object.fromEntries(Object.entries(values).map(([name, value]) => [name, words.heard[value] ?? value]))).join("");
  }
  return text;
}

function filled<Thing>(text: string, values: Readonly<Record<string, Thing>>): (string | Thing)[] {
  return text.split(/\{(\w+)\}/).map((part, i) => (i % 2 === 0 ? part : values[part]));
}

/** What a text with values looks like once they are in it. */
function matcher(english: string): RegExp {
  const pattern = english.split(/\{(\w+)\}/).map((part, i) => (i % 2 === 0 ? part.replace(/[.*+?^${}()|[\]\\]/g, "\\$&") : `(?<${part}>.+)`));
  return new RegExp(`^${pattern.join("")}$`, "s");
}
