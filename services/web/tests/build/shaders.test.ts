/** Shaders of three.js as the build of the page writes them. */
import { readdirSync, readFileSync } from "node:fs";
import { join, resolve } from "node:path";
import { ShaderChunk } from "three/src/renderers/shaders/ShaderChunk.js";
import { expect, test } from "vitest";
import { type SplitChunk, splitChunk, splitChunks } from "../../vite.shaders.ts";
import { minifyShader, minifyShaders } from "../../vite.three.ts";

const STAGE = resolve(import.meta.dirname, "../../src/stage");
const THREE = resolve(import.meta.dirname, "../../node_modules/three/src");

/** Put the removed code back. */
function restore({ kept, removed }: SplitChunk): string {
  const parts = removed.values();
  return kept.replace(/^#error$/gm, () => parts.next().value ?? "");
}

/** Return the directives of a shader, and the tokens of the code between them. */
function tokens(shader: string): string[] {
  return shader
    .replace(/\/\/.*/g, "")
    .replace(/\/\*.*?\*\//gs, "")
    .split("\n")
    .map((line) => line.trim())
    .flatMap((line) => (line.startsWith("#") ? [line] : (line.match(/\w+(?:\.\w*)?|\.\d+|--|\+\+|\S/g) ?? [])));
}

test("minified shaders have the tokens of their sources", () => {
  expect(minifyShader("// a\nx = - - y + ( - .5 ) * a [ 0 ]; /* b\n */\n\n\treturn -1.;")).toBe(
    "\nx=- - y+(- .5)*a[0];\nreturn -1.;",
  );
  for (const [name, chunk] of Object.entries(ShaderChunk))
    expect(tokens(minifyShader(chunk)), name).toEqual(tokens(chunk));
});

test("shaders in modules are minified around their expressions", () => {
  const code = "a = /* glsl */ `\n  // x\n  float ${ name } = ${a + b} + 1.;\n${CHUNK}\n`; b = `c  = d`;";
  expect(minifyShaders(code)).toBe("a = `\nfloat ${ name }=${a + b}+1.;\n${CHUNK}\n`; b = `c  = d`;");
  const nested = "/* glsl */ `a  = ${b ? `c` : ``};`";
  expect(minifyShaders(nested)).toBe(nested);
});

test("code of avatars is removed with the conditions in it", () => {
  const chunk = [
    "#ifdef USE_SHEEN",
    "#ifdef USE_COLOR",
    "a;",
    "#else",
    "b;",
    "#endif",
    "#elif defined( USE_MAP ) || ( NUM_POINT_LIGHTS > 0 ) && defined( RE_Direct )",
    "c;",
    "#else",
    "d;",
    "#endif",
  ].join("\n");
  const split = splitChunk(chunk);
  expect(split.kept.split("\n")).toEqual([
    "#ifdef USE_SHEEN",
    "#error",
    "#elif defined( USE_MAP ) || ( NUM_POINT_LIGHTS > 0 ) && defined( RE_Direct )",
    "#error",
    "#else",
    "d;",
    "#endif",
  ]);
  expect(split.removed).toEqual(["#ifdef USE_COLOR\na;\n#else\nb;\n#endif", "c;"]);
  expect(restore(split)).toBe(chunk);
});

test("code with conditions that the stage may fulfil is kept", () => {
  for (const condition of [
    "#ifdef USE_COLOR",
    "#ifndef USE_SHEEN",
    "#if ! defined( USE_SHEEN )",
    "#if defined( USE_SHEEN ) || defined( USE_COLOR )",
    "#if defined( USE_SHEEN ) && ( defined( USE_MAP ) || defined( USE_COLOR ) )",
    "#if NUM_SPOT_LIGHTS > 0",
  ]) {
    const chunk = `${condition}\na;\n#endif`;
    expect(splitChunk(chunk)).toEqual({ kept: chunk, removed: [] });
  }
});

test("the stage's shaders and the removed code are those of three.js", () => {
  const chunks = splitChunks();
  expect(Object.keys(chunks)).toEqual(Object.keys(ShaderChunk));
  for (const [name, chunk] of Object.entries(ShaderChunk))
    expect(restore(chunks[name]), name).toBe(minifyShader(chunk).trim());
});

/** Read all modules in a folder. */
function readModules(folder: string): string {
  return readdirSync(folder, { recursive: true, encoding: "utf8" })
    .filter((file) => /\.[jt]s$/.test(file))
    .map((file) => readFileSync(join(folder, file), "utf8"))
    .join("\n");
}

test("chunks that the stage and the modules of three.js name are not removed", () => {
  const chunks = splitChunks();
  const code = [STAGE, join(THREE, "extras"), join(THREE, "materials"), join(THREE, "renderers/webgl")].map(
    readModules,
  );
  const named = code.flatMap((text) => [...text.matchAll(/#include <(\w+)>|\bShaderChunk(?:\.|\[ ')(\w+)/g)]);
  // Examples in comments name other chunks.
  const names = new Set(named.map(([, included, member]) => included ?? member).filter((name) => name in chunks));
  expect([...names]).toEqual(expect.arrayContaining(["opaque_fragment", "cube_vert", "tonemapping_pars_fragment"]));
  for (const name of names) expect(chunks[name].kept, name).not.toBe("#error");
});
