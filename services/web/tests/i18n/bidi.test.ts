import { expect, test } from "vitest";
import { isolateBidi } from "../../src/i18n/bidi";
import { Translator } from "../../src/i18n/translator";

test("direction controls are removed, and right-to-left names are isolated", () => {
  const names = ["Sanbasō", "<b>", "愛子 👩🏽\u200d🚀", "\u202egnp.\u202c", "\u2067a\u2069\u2069", "שרה", "\u200fليلى"];
  expect(names.map(isolateBidi)).toEqual([
    "Sanbasō",
    "<b>",
    "愛子 👩🏽\u200d🚀",
    "gnp.",
    "a",
    "\u2068שרה\u2069",
    "\u2068ليلى\u2069",
  ]);
});

test("a name in a translated text does not affect the text around it", () => {
  const { translate } = new Translator();
  expect(translate("{name} holds this", { name: "\u202eAiko" })).toBe("Aiko holds this");
  expect(translate("{name} holds this", { name: "שרה" })).toBe("\u2068שרה\u2069 holds this");
});
