/** Choice of the page's language: the address (`?lang=`), else the stored choice, else the browser's preferences. */
import { browserStorage } from "../storage/web-storage";
import { type Language, type LocaleMessages, pageLanguage, setPageLanguage, Translator } from "./translator";

const STORAGE_KEY = "bunraku.language";
const LANGUAGES: readonly Language[] = ["en", "ja"];

/**
 * Return the first supported language among the requested, the stored and the preferred ones; English if there is
 * none.
 */
export function selectLanguage(
  requested: string | null,
  stored: string | null,
  preferred: readonly string[],
): Language {
  for (const tag of [requested, stored, ...preferred]) {
    const supported = LANGUAGES.find((language) => language === tag?.toLowerCase().split("-")[0]);
    if (supported) return supported;
  }
  return "en";
}

/** Load the page's language. Call this before any text is shown. Falls back to English if Japanese cannot be loaded. */
export async function loadPageLanguage(query: URLSearchParams): Promise<Language> {
  await loadLanguage(selectPageLanguage(query));
  return pageLanguage();
}

/** Return the page's language, which is not loaded by this. */
export function selectPageLanguage(query: URLSearchParams): Language {
  return selectLanguage(query.get("lang"), browserStorage.get(STORAGE_KEY), navigator.languages);
}

/** Load the translations of a language and use them from now on. Falls back to English if they cannot be loaded. */
export async function loadLanguage(language: Language): Promise<void> {
  const japanese = language === "ja" && (await loadJapaneseMessages());
  if (japanese) setPageLanguage("ja", japanese);
}

/** Return a Japanese translator for an embedded element; an English one if the translations cannot be loaded. */
export async function loadJapaneseTranslator(): Promise<Translator> {
  const japanese = await loadJapaneseMessages();
  return japanese ? new Translator("ja", japanese) : new Translator();
}

async function loadJapaneseMessages(): Promise<LocaleMessages | null> {
  try {
    const { JAPANESE_PAGE_MESSAGES, JAPANESE_SERVER_MESSAGES } = await import("./japanese");
    return { page: JAPANESE_PAGE_MESSAGES, server: JAPANESE_SERVER_MESSAGES };
  } catch (error) {
    console.warn("Japanese translations could not be loaded; using English.", error);
    return null;
  }
}

/** Return the language that the page does not use now. */
export function otherLanguage(): Language {
  return pageLanguage() === "en" ? "ja" : "en";
}

/**
 * Store the other language as the user's choice, and return the address to load. The address contains the language if
 * the browser cannot store it.
 */
export function switchLanguage(address: string): string {
  const url = new URL(address);
  const other = otherLanguage();
  browserStorage.put(STORAGE_KEY, other);
  if (browserStorage.get(STORAGE_KEY) === other) url.searchParams.delete("lang");
  else url.searchParams.set("lang", other);
  return url.href;
}
