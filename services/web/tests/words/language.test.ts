import { afterEach, beforeEach, describe, expect, test, vi } from "vitest";
import { chooseOther, chosenLanguage, japaneseSpeech, learnLanguage, otherLanguage } from "../../src/words/language";
import { language, say, speak } from "../../src/words/say";
import { forbidStorage, stubStorage } from "../storage/stubs";

let kept: Map<string, string>;

beforeEach(() => {
  kept = stubStorage("localStorage");
  vi.stubGlobal("navigator", { languages: ["fr-CA", "ja-JP", "en"] });
});
afterEach(() => {
  vi.unstubAllGlobals();
  speak("en");
});

describe("the language", () => {
  test("is the address's, else the one kept, else the first that the browser prefers and the page knows", () => {
    expect(chosenLanguage("en", "ja", ["ja"])).toBe("en");
    expect(chosenLanguage("ja-JP", "en", ["en"])).toBe("ja");
    expect(chosenLanguage(null, "ja", ["en"])).toBe("ja");
    expect(chosenLanguage("tlh", "", ["fr", "ja", "en-GB"])).toBe("ja");
    expect(chosenLanguage(null, null, ["fr", "EN-us", "ja"])).toBe("en");
    expect(chosenLanguage(null, null, [])).toBe("en");
  });

  test("is learnt before it is spoken", async () => {
    expect(await learnLanguage(new URLSearchParams())).toBe("ja");
    expect([language(), say("Strings")]).toEqual(["ja", "糸"]);
  });

  test("is English without anything to learn", async () => {
    expect(await learnLanguage(new URLSearchParams("lang=en"))).toBe("en");
    expect(say("Strings")).toBe("Strings");
  });
});

test("Japanese can be spoken beside the page's language", async () => {
  const { language: other, say: sayInJapanese } = await japaneseSpeech();
  expect([other, sayInJapanese("Strings")]).toEqual(["ja", "糸"]);
  expect([language(), say("Strings")]).toEqual(["en", "Strings"]);
});

describe("the other language", () => {
  test("is kept, and leaves the address, whose session stays", async () => {
    expect(otherLanguage()).toBe("ja");
    expect(chooseOther("https://stage/?session=a&lang=en")).toBe("https://stage/?session=a");
    expect(kept.get("bunraku.language")).toBe("ja");
    await learnLanguage(new URLSearchParams());
    expect([otherLanguage(), chooseOther("https://stage/?session=a")]).toEqual(["en", "https://stage/?session=a"]);
    expect(kept.get("bunraku.language")).toBe("en");
  });

  test("goes into the address where it cannot be kept", () => {
    forbidStorage("localStorage");
    expect(chooseOther("https://stage/?session=a")).toBe("https://stage/?session=a&lang=ja");
  });
});
