import { afterEach, describe, expect, test } from "vitest";
import { JAPANESE_PAGE_MESSAGES, JAPANESE_SERVER_MESSAGES } from "../../src/i18n/japanese";
import { formatDecimal, formatPercent } from "../../src/i18n/number-format";
import {
  joinList,
  pageLanguage,
  pageTranslator,
  setPageLanguage,
  Translator,
  translate,
  translateServerText,
  translateToParts,
} from "../../src/i18n/translator";

afterEach(() => setPageLanguage("en"));

describe("English", () => {
  test("is the default, with values filled in", () => {
    expect([pageLanguage(), translate("Drop a dance here"), translate("{count} here", { count: 5 })]).toEqual([
      "en",
      "Drop a dance here",
      "5 here",
    ]);
    expect(translate("{limb} {way}", { limb: "{way}", way: "up" })).toBe("{way} up");
    expect(joinList(["a", "b"])).toBe("a, b");
  });

  test("of the server is not changed", () => {
    expect(translateServerText("No such session")).toBe("No such session");
  });
});

describe("Japanese", () => {
  test("has values where the Japanese sentence needs them", () => {
    setPageLanguage("ja", { page: JAPANESE_PAGE_MESSAGES, server: JAPANESE_SERVER_MESSAGES });
    expect(pageLanguage()).toBe("ja");
    expect(translate("Give the {limb} to {name}", { name: "Aiko", limb: translate("Left hand") })).toBe(
      "左手をAikoさんに譲る",
    );
    const [first, last] = [{ key: 1 }, { key: 4 }];
    expect(translateToParts("Drag a ring on the stage, or press {first} to {last}.", { first, last })).toEqual([
      "舞台の輪をドラッグするか、",
      first,
      "〜",
      last,
      "を押します。",
    ]);
  });

  test("translates known server texts with their values; others are unchanged", () => {
    setPageLanguage("ja", { page: JAPANESE_PAGE_MESSAGES, server: JAPANESE_SERVER_MESSAGES });
    expect(translateServerText("No such session")).toBe("その舞台は見つかりません");
    expect(translateServerText("a file may have 64000000 bytes")).toBe("上限は64000000バイトです");
    expect(translateServerText("the left hand is not yours: an input for it was refused")).toBe(
      "左手はあなたが持っていないため、動かせません",
    );
    for (const text of ["No such thing", "a file may have bytes", "", "there is no motion"])
      expect(translateServerText(text)).toBe(text);
  });
});

test("translators are independent of each other and of the page's", () => {
  const japanese = new Translator("ja", { page: JAPANESE_PAGE_MESSAGES, server: JAPANESE_SERVER_MESSAGES });
  const { translate: toJapanese, translateServerText: serverTextToJapanese } = japanese;
  expect([
    japanese.language,
    toJapanese("Strings"),
    serverTextToJapanese("No such session"),
    japanese.joinList(["a", "b"]),
  ]).toEqual(["ja", "糸", "その舞台は見つかりません", "a、b"]);
  expect([
    new Translator().translate("Strings"),
    pageTranslator.translate("Strings"),
    pageLanguage(),
    translateServerText("No such session"),
  ]).toEqual(["Strings", "Strings", "en", "No such session"]);
});

test("numbers are formatted in the page's language", () => {
  for (const language of ["en", "ja"] as const) {
    setPageLanguage(language);
    expect([
      formatDecimal(3.456, 1),
      formatDecimal(7, 2),
      formatDecimal(999.6, 0),
      formatDecimal(12_345, 0),
      formatDecimal(-0.01, 1),
    ]).toEqual(["3.5", "7.00", "1000", "12,345", "0.0"]);
    expect([0, 0.455, 1].map(formatPercent)).toEqual(["0%", "46%", "100%"]);
  }
});
