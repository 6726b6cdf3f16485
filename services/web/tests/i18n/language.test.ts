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

let kept: Map<string, string>;

beforeEach(() => {
  kept = stubStorage("localStorage");
  vi.stubGlobal("navigator", { languages: ["fr-CA", "ja-JP", "en"] });
});
afterEach(() => {
  vi.unstubAllGlobals();
  setPageLanguage("en");
});

describe("the language", () => {
  test("is the address's, else the one kept, else the first that the browser prefers and the page knows", () => {
    expect(selectLanguage("en", "ja", ["ja"])).toBe("en");
    expect(selectLanguage("ja-JP", "en", ["en"])).toBe("ja");
    expect(selectLanguage(null, "ja", ["en"])).toBe("ja");
    expect(selectLanguage("tlh", "", ["fr", "ja", "en-GB"])).toBe("ja");
    expect(selectLanguage(null, null, ["fr", "EN-us", "ja"])).toBe("en");
    expect(selectLanguage(null, null, [])).toBe("en");
  });

  test("is learnt before it is spoken", async () => {
    expect(await loadPageLanguage(new URLSearchParams())).toBe("ja");
    expect([pageLanguage(), translate("Strings")]).toEqual(["ja", "糸"]);
  });

  test("is English without anything to learn", async () => {
    expect(await loadPageLanguage(new URLSearchParams("lang=en"))).toBe("en");
    expect(translate("Strings")).toBe("Strings");
  });
});

test("Japanese can be spoken beside the page's language", async () => {
  const { language: other, translate: sayInJapanese } = await loadJapaneseTranslator();
  expect([other, sayInJapanese("Strings")]).toEqual(["ja", "糸"]);
  expect([pageLanguage(), translate("Strings")]).toEqual(["en", "Strings"]);
});

describe("the other language", () => {
  test("is kept, and leaves the address, whose session stays", async () => {
    expect(otherLanguage()).toBe("ja");
    expect(switchLanguage("https://stage/?session=a&lang=en")).toBe("https://stage/?session=a");
    expect(kept.get("bunraku.language")).toBe("ja");
    await loadPageLanguage(new URLSearchParams());
    expect([otherLanguage(), switchLanguage("https://stage/?session=a")]).toEqual(["en", "https://stage/?session=a"]);
    expect(kept.get("bunraku.language")).toBe("en");
  });

  test("goes into the address where it cannot be kept", () => {
    forbidStorage("localStorage");
    expect(switchLanguage("https://stage/?session=a")).toBe("https://stage/?session=a&lang=ja");
  });
});
