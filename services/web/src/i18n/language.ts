/** Which language the page speaks: the address's (`?lang=`), else the one chosen before, else the first of the browser's that it knows. */
import { browserStorage } from "../storage/web-storage";
import { type Language, type LocaleMessages, pageLanguage, setPageLanguage, Translator } from "./translator";

const STORAGE_KEY = "bunraku.language";
const LANGUAGES: readonly Language[] = ["en", "ja"];

/** The language by what is asked for in the address, what was kept, and what the browser prefers, best first. */
export function selectLanguage(
  requested: string | null,
  stored: string | null,
  preferred: readonly string[],
): Language {
  for (const tag of [requested, stored, ...preferred]) {
    const known = LANGUAGES.find((one) => one === tag?.toLowerCase().split("-")[0]);
    if (known) return known;
  }
  return "en";
}

/** Learns the language of the page and speaks it: before anything is said. English where the other cannot be fetched. */
export async function loadPageLanguage(query: URLSearchParams): Promise<Language> {
  const japanese =
    selectLanguage(query.get("lang"), browserStorage.get(STORAGE_KEY), navigator.languages) === "ja" &&
    (await loadJapaneseMessages());
  if (japanese) setPageLanguage("ja", japanese);
  return pageLanguage();
}

/** How Japanese is spoken by what is no page of its own. English where the words cannot be fetched. */
export async function loadJapaneseTranslator(): Promise<Translator> {
  const japanese = await loadJapaneseMessages();
  return japanese ? new Translator("ja", japanese) : new Translator();
}

async function loadJapaneseMessages(): Promise<LocaleMessages | null> {
  try {
    const { JAPANESE_PAGE_MESSAGES: JAPANESE, JAPANESE_SERVER_MESSAGES: HEARD } = await import("./japanese");
    return { page: JAPANESE, server: HEARD };
  } catch (error) {
    console.warn("the Japanese words cannot be fetched.", error);
    return null;
  }
}

/** The one that the page does not setPageLanguage. */
export function otherLanguage(): Language {
  return pageLanguage() === "en" ? "ja" : "en";
}

/** Chooses the other language, to be spoken from the next loading on. Returns the address to load: it says the language where that cannot be kept. */
export function switchLanguage(address: string): string {
  const url = new URL(address);
  const other = otherLanguage();
  browserStorage.put(STORAGE_KEY, other);
  if (browserStorage.get(STORAGE_KEY) === other) url.searchParams.delete("lang");
  else url.searchParams.set("lang", other);
  return url.href;
}
