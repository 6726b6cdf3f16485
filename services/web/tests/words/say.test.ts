import { afterEach, describe, expect, test } from "vitest";
import { HEARD, JAPANESE } from "../../src/words/japanese";
import { decimal, percent } from "../../src/words/numbers";
import { heard, language, pageSpeech, say, sayAround, series, speak, Speech } from "../../src/words/say";

afterEach(() => speak("en"));

describe("English", () => {
  test("is spoken where nothing else is learnt, with values in their places", () => {
    expect([language(), say("Drop a dance here"), say("{count} here", { count: 5 })]).toEqual(["en", "Drop a dance here", "5 here"]);
    expect(say("{limb} {way}", { limb: "{way}", way: "up" })).toBe("{way} up");
    expect(series(["a", "b"])).toBe("a, b");
  });

  test("of the server is shown as it comes", () => {
    expect(heard("No such session")).toBe("No such session");
  });
});

describe("Japanese", () => {
  test("puts the values where its own sentence has them", () => {
    speak("ja", { said: JAPANESE, heard: HEARD });
    expect(language()).toBe("ja");
    expect(say("Give the {limb} to {name}", { name: "Aiko", limb: say("Left hand") })).toBe("左手をAikoさんに譲る");
    const [first, last] = [{ key: 1 }, { key: 4 }];
    expect(sayAround("Drag a ring on the stage, or press {first} to {last}.", { first, last })).toEqual(["舞台の輪をドラッグするか、", first, "〜", last, "を押します。"]);
  });

  test("is there for what is heard from the server, also with values in it; the rest is shown as it comes", () => {
    speak("ja", { said: JAPANESE, heard: HEARD });
    expect(heard("No such session")).toBe("その舞台は見つかりません");
    expect(heard("a file may have 64000000 bytes")).toBe("上限は64000000バイトです");
    expect(heard("the left hand is not yours: an input for it was refused")).toBe("左手はあなたが持っていないため、動かせません");
    for (const text of ["No such thing", "a file may have bytes", "", "there is no motion"]) expect(heard(text)).toBe(text);
  });
});

test("two speeches are spoken beside each other, and beside the page's", () => {
  const japanese = new Speech("ja", { said: JAPANESE, heard: HEARD });
  const { say: sayInJapanese, heard: heardInJapanese } = japanese;
  expect([japanese.language, sayInJapanese("Strings"), heardInJapanese("No such session"), japanese.series(["a", "b"])]).toEqual(["ja", "糸", "その舞台は見つかりません", "a、b"]);
  expect([new Speech().say("Strings"), pageSpeech.say("Strings"), language(), heard("No such session")]).toEqual(["Strings", "Strings", "en", "No such session"]);
});

test("numbers have the language's form", () => {
  for (const language of ["en", "ja"] as const) {
    speak(language);
    expect([decimal(3.456, 1), decimal(7, 2), decimal(999.6, 0), decimal(12_345, 0), decimal(-0.01, 1)]).toEqual(["3.5", "7.00", "1000", "12,345", "0.0"]);
    expect([0, 0.455, 1].map(percent)).toEqual(["0%", "46%", "100%"]);
  }
});
