/** Which language the page speaks: the address's (`?lang=`), else the one chosen before, else the first of the browser's that it knows. */
import { browserStore } from "../storage/store";
import { language, speak, Speech, type Language, type Words } from "./say";

const KEY = "bunraku.language";
const LANGUAGES: readonly Language[] = ["en", "ja"];

/** The language by what is asked for in the address, what was kept, and what the browser prefers, best first. */
export function chosenLanguage(asked: string | null, kept: string | null, preferred: readonly string[]): Language {
  for (const tag of [asked, kept, ...preferred]) {
    const known = LANGUAGES.find((one) => one === tag?.toLowerCase().split("-")[0]);
    if (known) return known;
  }
  return "en";
}

/** Learns the language of the page and speaks it: before anything is said. English where the other cannot be fetched. */
export async function learnLanguage(query: URLSearchParams): Promise<Language> {
  const japanese = chosenLanguage(query.get("lang"), browserStore.get(KEY), navigator.languages) === "ja" && (await fetchJapanese());
  if (japanese) speak("ja", japanese);
  return language();
}

/** How Japanese is spoken by what is no page of its own. English where the words cannot be fetched. */
export async function japaneseSpeech(): Promise<Speech> {
  const japanese = await fetchJapanese();
  return japanese ? new Speech("ja", japanese) : new Speech();
}

async function fetchJapanese(): Promise<Words | null> {
  try {
    const { JAPANESE, HEARD } = await import("./japanese");
    return { said: JAPANESE, heard: HEARD };
  } catch (error) {
    console.warn("the Japanese words cannot be fetched.", error);
    return null;
  }
}

/** The one that the page does not speak. */
export function otherLanguage(): Language {
  return language() === "en" ? "ja" : "en";
}

/** Chooses the other language, to be spoken from the next loading on. Returns the address to load: it says the language where that cannot be kept. */
export function chooseOther(address: string): string {
  const url = new URL(address);
  const other = otherLanguage();
  browserStore.put(KEY, other);
  if (browserStore.get(KEY) === other) url.searchParams.delete("lang");
  else url.searchParams.set("lang", other);
  return url.href;
}
