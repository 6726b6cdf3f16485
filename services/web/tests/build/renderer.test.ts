/** Modules of three.js's renderer that the build of the page replaces. */
import { globSync, readFileSync } from "node:fs";
import { resolve } from "node:path";
import { build, type Rolldown } from "vite";
import { expect, test } from "vitest";
import { REPLACED_MODULES, removeUnusedMethods, UNUSED_NAMES } from "../../vite.renderer.ts";

const SOURCES = resolve(import.meta.dirname, "../../node_modules/three/src");
/** Members that the renderer uses only while a session is presented, in the present version of three.js. */
const SESSION_MEMBERS = ["cameraAutoUpdate", "getCamera", "getDepthSensingMesh", "hasDepthSensing", "updateCamera"];

const read = (path: string) => readFileSync(resolve(SOURCES, path), "utf8");
const evaluate = (path: string) =>
  import(`data:text/javascript,${encodeURIComponent(REPLACED_MODULES[path])}`) as Promise<
    Record<string, new () => object>
  >;

test("each replaced module exists and has the exports of its replacement", async () => {
  for (const path of Object.keys(REPLACED_MODULES)) {
    const names = Object.keys(await evaluate(path)).filter((name) => name !== "completeWith");
    for (const name of names) expect(read(path)).toMatch(new RegExp(`export (class|function|\\{) ?${name}\\b`));
  }
});

test("the replaced WebXR manager has what the renderer uses without a session", async () => {
  const { WebXRManager } = await evaluate("renderers/webxr/WebXRManager.js");
  const xr = new WebXRManager();
  const sources = read("renderers/WebGLRenderer.js") + read("renderers/webgl/WebGLBackground.js");
  const used = new Set(Array.from(sources.matchAll(/\bxr\.(\w+)/g), ([, member]) => member));
  expect(used.size).toBeGreaterThan(10);
  expect([...used].filter((member) => !(member in xr)).sort()).toEqual(SESSION_MEMBERS);
});

test("a completed renderer has the WebXR manager of three.js", async () => {
  const replaced = await evaluate("renderers/webxr/WebXRManager.js");
  class Manager {}
  (replaced["completeWith"] as unknown as (manager: unknown) => void)(Manager);
  expect(new replaced["WebXRManager"]()).toBeInstanceOf(Manager);
});

test("the replaced array of frusta has what objects ask it", async () => {
  const { FrustumArray } = await evaluate("math/FrustumArray.js");
  const frusta = new FrustumArray();
  for (const file of ["objects/Mesh.js", "objects/Sprite.js", "objects/Line.js", "objects/Points.js"]) {
    const [, method] = /frustum\.(\w+)\( this \)/.exec(read(file)) ?? [];
    expect((frusta as Record<string, () => boolean>)[method]()).toBe(true);
  }
});

test("the replaced groups of uniforms have what the renderer uses without groups", async () => {
  const { WebGLUniformsGroups } = await evaluate("renderers/webgl/WebGLUniformsGroups.js");
  const groups = new WebGLUniformsGroups();
  const used = new Set(
    Array.from(read("renderers/WebGLRenderer.js").matchAll(/uniformsGroups\.(\w+)\(/g), ([, member]) => member),
  );
  expect([...used].filter((member) => !(member in groups)).sort()).toEqual(["bind", "update"]);
});

test("methods and functions are removed as a whole", () => {
  const files = globSync("{core,cameras,extras/core,lights,materials,math,objects,renderers,textures}/*.js", {
    cwd: SOURCES,
  });
  expect(files.length).toBeGreaterThan(100);
  let removedBytes = 0;
  for (const file of files) {
    const code = read(file);
    const reduced = removeUnusedMethods(code);
    removedBytes += code.length - reduced.length;
    const count = (character: string) => reduced.split(character).length - code.split(character).length;
    expect([file, count("{")]).toEqual([file, count("}")]);
  }
  expect(removedBytes).toBeGreaterThan(100_000);
});

test("no script of the page contains the name of a removed method or of a colour", async () => {
  const web = resolve(import.meta.dirname, "../..");
  const options = { write: false, emptyOutDir: false, minify: false } as const;
  const { output } = (await build({ root: web, logLevel: "error", build: options })) as Rolldown.RolldownOutput;
  const code = output.map((file) => (file.type === "chunk" ? file.code : "")).join("\n");
  const withoutComments = code.replace(/\/\*.*?\*\/|^\s*\/\/[^\n]*/gms, "");
  const words = new Set(withoutComments.match(/[\w$]+/g));
  expect(words).toContain("WebGLRenderer");
  expect(UNUSED_NAMES.filter((name) => words.has(name))).toEqual([]);
  // Materials of avatars and the stage have their colours as numbers.
  const [, names = ""] = /_colorKeywords = \{(.*?)\}/s.exec(read("math/Color.js")) ?? [];
  const colours = Array.from(names.matchAll(/'(\w+)'/g), ([, name]) => name);
  expect(colours.length).toBeGreaterThan(100);
  const passed = new Set(
    Array.from(withoutComments.matchAll(/(?:Color\(|\bcolor: |\.set\() ?["'](\w+)["']/g), ([, name]) => name),
  );
  expect(colours.filter((name) => passed.has(name))).toEqual([]);
});
