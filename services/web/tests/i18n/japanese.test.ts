/** Every text that the page has, it has in Japanese; and what it says to people, it says by `say`. */
import { readdirSync, readFileSync } from "node:fs";
import { join, resolve } from "node:path";
import { describe, expect, test } from "vitest";
import { JAPANESE_PAGE_MESSAGES, JAPANESE_SERVER_MESSAGES } from "../../src/i18n/japanese";

const SOURCES = resolve(import.meta.dirname, "../../src");
const SERVER = resolve(import.meta.dirname, "../../../bunraku");

/** The sources below a folder with an ending, by their path. */
function read(folder: string, ending: string): Map<string, string> {
  const files = readdirSync(folder, { recursive: true, encoding: "utf8" }).filter((file) => file.endsWith(ending));
  return new Map(files.map((file) => [file, readFileSync(join(folder, file), "utf8")]));
}

const sources = read(SOURCES, ".ts");
sources.delete(join("i18n", "japanese.ts"));
const code = [...sources.values()].join("\n");
/** Every string of the sources in double quotes. */
const strings = new Set([...code.matchAll(/"((?:[^"\\\n]|\\.)*)"/g)].map(([, text]) => text.replace(/\\(.)/g, "$1")));

/** The names of a text's values, in order of the alphabet. */
function names(text: string): string[] {
  return [...text.matchAll(/\{(\w+)\}/g)].map(([, name]) => name).sort();
}

describe("every text", () => {
  test("that is said has Japanese", () => {
    const said = [...code.matchAll(/\btranslate(?:ToParts)?\(\s*"((?:[^"\\\n]|\\.)*)"/g)].map(([, text]) =>
      text.replace(/\\(.)/g, "$1"),
    );
    expect(said.length).toBeGreaterThan(100);
    expect(said.filter((text) => !(text in JAPANESE_PAGE_MESSAGES))).toEqual([]);
  });

  test("that has Japanese is used", () => {
    expect(Object.keys(JAPANESE_PAGE_MESSAGES).filter((text) => !strings.has(text))).toEqual([]);
  });

  test("has the same values in both languages, and Japanese in its Japanese", () => {
    for (const [english, japanese] of [
      ...Object.entries(JAPANESE_PAGE_MESSAGES),
      ...Object.entries(JAPANESE_SERVER_MESSAGES),
    ]) {
      expect(names(japanese), english).toEqual(names(english));
      // but for the punctuation alone, and what is written the same
      if (
        /[a-z]/.test(english.replace(/\{\w+\}/g, "")) &&
        !["{part} of {whole}", "{reason} ({rate} kbit/s)"].includes(english)
      )
        expect(japanese, english).toMatch(/[\p{Script=Hiragana}\p{Script=Katakana}\p{Script=Han}]/u);
      expect(japanese, english).not.toMatch(/[,?!;]|\.$/);
    }
  });
});

test("what is heard from the server is what it says", () => {
  // Python joins strings that follow each other, and formats what is in braces
  const said = [...read(SERVER, ".py").values()]
    .join("\n")
    .replace(/"\s*\n\s*f?"/g, "")
    .replace(/\{[^{}"\n]*\}/g, "{}")
    .replace(/\bLIMBS\[[^\n]*\n/g, "");
  const limbs = ["left hand", "right hand", "left leg", "right leg"];
  const unknown = Object.keys(JAPANESE_SERVER_MESSAGES).filter(
    (text) => !limbs.includes(text) && !said.includes(text.replace(/\{\w+\}/g, "{}")),
  );
  expect(unknown).toEqual([]);
});

describe("texts for people", () => {
  /** Places of the code where a text is shown as it stands: attributes, messages, and what elements hold but for the wordmark and keys. */
  const BARE = [
    /"?(aria-label|aria-valuetext|title|placeholder|alt)"?: ["`]/,
    /setAttribute\("aria-(label|valuetext)", ["`]/,
    /(toast|showDisconnected|showError|confirm|alert)\(["`]/,
    // what a notice is about comes first
    /notice\((?!"(access|graphics|dance)", [^"`])["`]/,
    /element\("\w+", \{[^}]*\}, ["`](?!Bunraku"|Esc"|\?"|\d")/,
  ];

  test("are translated", () => {
    const shown = [...sources].filter(([file]) => /^(ui|app|client|input|element)\b|^\w+\.ts$/.test(file));
    const lines = shown.flatMap(([file, source]) => source.split("\n").map((line) => `${file}: ${line.trim()}`));
    expect(lines.filter((line) => BARE.some((bare) => bare.test(line)))).toEqual([]);
  });

  test("are not said while modules load, before the language is known", () => {
    for (const [file, source] of sources)
      expect(source.match(/^(export )?(const|let) [^=]*=(?!.*=>).*\btranslate\(.*$/gm) ?? [], file).toEqual([]);
  });

  test("of the HTML are the page's own", () => {
    const html = readFileSync(resolve(SOURCES, "../index.html"), "utf8");
    const label = /<canvas[^>]* aria-label="([^"]+)"/.exec(html)?.[1];
    expect(label && label in JAPANESE_PAGE_MESSAGES).toBe(true);
  });
});
