/** Completeness of the Japanese translations, checked on the syntax trees of all sources. */
import { readdirSync, readFileSync } from "node:fs";
import { join, resolve } from "node:path";
import { parseSync } from "vite";
import { describe, expect, test } from "vitest";
import { JAPANESE_PAGE_MESSAGES, JAPANESE_SERVER_MESSAGES } from "../../src/i18n/japanese";

const SOURCES = resolve(import.meta.dirname, "../../src");
const SERVER = resolve(import.meta.dirname, "../../../bunraku");

/** Node of an ESTree syntax tree. */
interface Node {
  type: string;
  start: number;
  [key: string]: unknown;
}

/** Return the text of all files below a folder with this extension, by path. */
function readSources(folder: string, extension: string): Map<string, string> {
  const files = readdirSync(folder, { recursive: true, encoding: "utf8" }).filter((file) => file.endsWith(extension));
  return new Map(files.map((file) => [file, readFileSync(join(folder, file), "utf8")]));
}

const sources = readSources(SOURCES, ".ts");
sources.delete(join("i18n", "japanese.ts"));
const trees = new Map(
  [...sources].map(([file, source]) => {
    const { program, errors } = parseSync(file, source);
    if (errors.length > 0) throw new Error(`${file}: ${errors[0].message}`);
    return [file, program as unknown as Node];
  }),
);

function isNode(value: unknown): value is Node {
  return typeof value === "object" && value !== null && typeof (value as Node).type === "string";
}

/** Yield a node and all nodes inside it, except those inside nodes for which `skip` is true. */
function* walk(node: Node, skip: (node: Node) => boolean = () => false): Generator<Node> {
  if (skip(node)) return;
  yield node;
  for (const value of Object.values(node)) {
    for (const child of Array.isArray(value) ? value : [value]) if (isNode(child)) yield* walk(child, skip);
  }
}

/** Return the name of the function or method that a call expression calls. */
function calledName({ type, callee }: Node): string | null {
  if (type !== "CallExpression" || !isNode(callee)) return null;
  const name = callee.type === "MemberExpression" ? callee["property"] : callee;
  return isNode(name) && typeof name["name"] === "string" ? name["name"] : null;
}

function argumentsOf(call: Node): Node[] {
  return call["arguments"] as Node[];
}

/** Return the string literals that an expression may evaluate to, looking into conditions and type assertions. */
function literalsOf(node: unknown): string[] {
  if (!isNode(node)) return [];
  if (node.type === "Literal") return typeof node["value"] === "string" ? [node["value"]] : [];
  if (node.type === "TemplateLiteral")
    return [(node["quasis"] as { value: { raw: string } }[]).map(({ value }) => value.raw).join("{}")];
  if (node.type === "ConditionalExpression") return [node["consequent"], node["alternate"]].flatMap(literalsOf);
  if (node.type === "LogicalExpression") return literalsOf(node["right"]);
  if (node.type === "TSAsExpression" || node.type === "ParenthesizedExpression") return literalsOf(node["expression"]);
  return [];
}

function isTranslation(node: Node): boolean {
  return ["translate", "translateToParts"].includes(calledName(node) ?? "");
}

/** Return the names of a text's placeholders, sorted. */
function placeholders(text: string): string[] {
  return [...text.matchAll(/\{(\w+)\}/g)].map(([, name]) => name).sort();
}

const nodes = [...trees.values()].flatMap((tree) => [...walk(tree)]);

describe("page messages", () => {
  test("every translated text has a Japanese entry", () => {
    const translated = nodes.filter(isTranslation).flatMap((call) => literalsOf(argumentsOf(call)[0]));
    expect(translated.length).toBeGreaterThan(100);
    expect(translated.filter((text) => !(text in JAPANESE_PAGE_MESSAGES))).toEqual([]);
  });

  test("every Japanese entry is used", () => {
    const strings = new Set(nodes.flatMap((node) => (node.type === "Literal" ? literalsOf(node) : [])));
    expect(Object.keys(JAPANESE_PAGE_MESSAGES).filter((text) => !strings.has(text))).toEqual([]);
  });

  test("both languages have the same placeholders, and the Japanese is Japanese", () => {
    // texts that are written alike in both languages
    const shared = ["{part} of {whole}", "{reason} ({rate} kbit/s)"];
    for (const [english, japanese] of [
      ...Object.entries(JAPANESE_PAGE_MESSAGES),
      ...Object.entries(JAPANESE_SERVER_MESSAGES),
    ]) {
      expect(placeholders(japanese), english).toEqual(placeholders(english));
      const hasWords = /[a-z]/.test(english.replace(/\{\w+\}/g, ""));
      if (hasWords && !shared.includes(english))
        expect(japanese, english).toMatch(/[\p{Script=Hiragana}\p{Script=Katakana}\p{Script=Han}]/u);
      expect(japanese, english).not.toMatch(/[,?!;]|\.$/);
    }
  });
});

test("every server message with a Japanese entry occurs in the server's source", () => {
  // Python concatenates adjacent strings, and formats expressions in braces.
  const server = [...readSources(SERVER, ".py").values()]
    .join("\n")
    .replace(/"\s*\n\s*f?"/g, "")
    .replace(/\{[^{}"\n]*\}/g, "{}")
    .replace(/\bLIMBS\[[^\n]*\n/g, "");
  const limbs = ["left hand", "right hand", "left leg", "right leg"];
  const unknown = Object.keys(JAPANESE_SERVER_MESSAGES).filter(
    (text) => !limbs.includes(text) && !server.includes(text.replace(/\{\w+\}/g, "{}")),
  );
  expect(unknown).toEqual([]);
});

describe("texts in the user interface", () => {
  const LABELS = ["aria-label", "aria-valuetext", "title", "placeholder", "alt"];
  const MESSAGE_FUNCTIONS = ["toast", "notify", "showDisconnected", "showError", "confirm", "alert"];
  const NOTICE_SUBJECTS = ["access", "graphics", "dance"];
  /** Texts that are the same in all languages: wordmark and keys. */
  const UNTRANSLATED = /^((\{\} - )?Bunraku|Esc|\?|\d.*)$/;

  const needsTranslation = (text: string) => !UNTRANSLATED.test(text);

  /** Return the literals that a node shows to the user without translating them. */
  function untranslatedTexts(node: Node): string[] {
    if (node.type === "Property") {
      const { key, value } = node as unknown as { key: Node; value: Node };
      return LABELS.includes(String(key["name"] ?? key["value"])) ? literalsOf(value) : [];
    }
    if (node.type === "AssignmentExpression") {
      const { left, right } = node as unknown as { left: Node; right: Node };
      const target = isNode(left["property"]) ? left["property"]["name"] : null;
      return target === "ariaLabel" || target === "title" ? literalsOf(right).filter(needsTranslation) : [];
    }
    const name = calledName(node);
    if (name === null) return [];
    const args = argumentsOf(node);
    if (name === "setAttribute")
      return args.flatMap((arg, i) =>
        literalsOf(arg).some((text) => LABELS.includes(text)) ? literalsOf(args[i + 1]) : [],
      );
    if (MESSAGE_FUNCTIONS.includes(name)) return literalsOf(args[0]);
    if (name === "notice") {
      const hasSubject = literalsOf(args[0]).some((text) => NOTICE_SUBJECTS.includes(text));
      return args.slice(hasSubject ? 1 : 0).flatMap(literalsOf);
    }
    if (name === "element") return args.slice(2).flatMap(literalsOf).filter(needsTranslation);
    return [];
  }

  test("are translated", () => {
    const shown = [...trees].filter(([file]) => /^(ui|app|client|input|element)\b|^\w+\.ts$/.test(file));
    const found = shown.flatMap(([file, tree]) =>
      [...walk(tree)].flatMap(untranslatedTexts).map((text) => `${file}: ${text}`),
    );
    expect(found).toEqual([]);
  });

  test("are not translated while modules load, before the language is known", () => {
    const isDeferred = ({ type, static: isStatic }: Node) =>
      /Function/.test(type) || (type === "PropertyDefinition" && !isStatic);
    for (const [file, tree] of trees) expect([...walk(tree, isDeferred)].filter(isTranslation), file).toEqual([]);
  });

  test("in the HTML page have a Japanese entry", () => {
    const html = readFileSync(resolve(SOURCES, "../index.html"), "utf8");
    const label = /<canvas[^>]* aria-label="([^"]+)"/.exec(html)?.[1];
    expect(label && label in JAPANESE_PAGE_MESSAGES).toBe(true);
  });
});
