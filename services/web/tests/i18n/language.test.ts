import { afterEach, beforeEach, describe, expect, test, vi } from "vitest";
import {
  loadJapaneseTranslator,
  loadPageLanguage,
  otherLanguage,
  selectLanguage,
  switchLanguage,
} from "../../src/i18n/language";
import { pageLanguage, setPageLanguage, translate } from "../../src/i18n/translator";
import { forbidStorage, stubStorage } from "../storage/storage-stub";

let stored: Map<string, string>;

beforeEach(() => {
  stored = stubStorage("localStorage");
  vi.stubGlobal("navigator", { languages: ["fr-CA", "ja-JP", "en"] });
});
afterEach(() => {
  vi.unstubAllGlobals();
  setPageLanguage("en");
});

describe("language", () => {
  test("is the address's, else the stored one, else a preferred one", () => {
    expect(selectLanguage("en", "ja", ["ja"])).toBe("en");
    expect(selectLanguage("ja-JP", "en", ["en"])).toBe("ja");
    expect(selectLanguage(null, "ja", ["en"])).toBe("ja");
    expect(selectLanguage("tlh", "", ["fr", "ja", "en-GB"])).toBe("ja");
    expect(selectLanguage(null, null, ["fr", "EN-us", "ja"])).toBe("en");
    expect(selectLanguage(null, null, [])).toBe("en");
  });

  test("is loaded before texts are translated", async () => {
    expect(await loadPageLanguage(new URLSearchParams())).toBe("ja");
    expect([pageLanguage(), translate("Strings")]).toEqual(["ja", "糸"]);
  });

  test("is English without loading translations", async () => {
    expect(await loadPageLanguage(new URLSearchParams("lang=en"))).toBe("en");
    expect(translate("Strings")).toBe("Strings");
  });
});

test("Japanese translator is independent of the page's language", async () => {
  const { language, translate: translateToJapanese } = await loadJapaneseTranslator();
  expect([language, translateToJapanese("Strings")]).toEqual(["ja", "糸"]);
  expect([pageLanguage(), translate("Strings")]).toEqual(["en", "Strings"]);
});

describe("other language", () => {
  test("is stored, and removed from the address", async () => {
    expect(otherLanguage()).toBe("ja");
    expect(switchLanguage("https://stage/?session=a&lang=en")).toBe("https://stage/?session=a");
    expect(stored.get("bunraku.language")).toBe("ja");
    await loadPageLanguage(new URLSearchParams());
    expect([otherLanguage(), switchLanguage("https://stage/?session=a")]).toEqual(["en", "https://stage/?session=a"]);
    expect(stored.get("bunraku.language")).toBe("en");
  });

  test("is put into the address if it cannot be stored", () => {
    forbidStorage("localStorage");
    expect(switchLanguage("https://stage/?session=a")).toBe("https://stage/?session=a&lang=ja");
  });
});
