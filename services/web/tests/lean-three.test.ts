import { readdirSync, readFileSync } from "node:fs";
import { join } from "node:path";
import { expect, test } from "vitest";
import { lean } from "../lean-three.ts";

const SHADERS = join(import.meta.dirname, "../node_modules/three/src/renderers/shaders");

/** Every file of shaders by its name, as it is and as it is built in. */
function built(folder: string): Map<string, { before: string; after: string }> {
  return new Map(
    readdirSync(join(SHADERS, folder)).map((name) => {
      const path = join(SHADERS, folder, name);
      const before = readFileSync(path, "utf8");
      return [name.replace(".glsl.js", ""), { before, after: lean(before, path) }];
    }),
  );
}

test("no text of a shader keeps comments, and no line that the compiler's own need breaks", () => {
  for (const [, { before, after }] of [...built("ShaderChunk"), ...built("ShaderLib")]) {
    expect(after).not.toMatch(/glsl \*\/|\/\/ /);
    if (!/= ""|default ""/.test(after))
      expect(after.match(/#(if|endif)/g)).toEqual(before.replace(/\/\*[^`]*?\*\/|\/\/.*/g, "").match(/#(if|endif)/g));
  }
});

test("what the stage and its guests are made of stays, what nothing is made of goes", () => {
  const empty = [...built("ShaderLib")].filter(([, { after }]) => /vertex = ""/.test(after)).map(([name]) => name);
  expect(empty.sort()).toEqual([
    "background",
    "backgroundCube",
    "distance",
    "equirect",
    "linedashed",
    "meshmatcap",
    "meshnormal",
    "meshphong",
    "meshtoon",
    "shadow",
    "sprite",
  ]);
});

test("what is left out of the parts is nothing without a feature that the stage has not", () => {
  for (const [name, { before, after }] of built("ShaderChunk")) {
    if (!/default ""/.test(after)) continue;
    // for a compiler it begins with a condition and ends with it, or it belongs to a material that is left out
    const text = before
      .replace(/\/\/.*/g, "")
      .replace(/^[^`]*`|`[^`]*$/g, "")
      .trim();
    expect(/^#if[\s\S]*#endif$/.test(text) || /toon|phong|gradientmap/.test(name), name).toBe(true);
  }
});

test("spaces go where a compiler needs none", () => {
  const shader = (text: string) =>
    lean(`export default /* glsl */\`${text}\`;`, "/three/src/renderers/shaders/ShaderChunk/one.glsl.js");
  expect(
    shader(
      "\n#define LEAST 1e-6 * 2.0\n\tfloat a = b - - c + d [ 1 ] * 2.0; // note\n\tif ( a >= b && ! c ) { return; }\n",
    ),
  ).toBe(
    String.raw`export default "\n#define LEAST 1e-6 * 2.0\nfloat a=b - - c + d[1]*2.0;\nif(a>=b&&! c){return;}\n";`,
  );
});

test("what stands in for an idle part of the renderer answers what the renderer asks of it", () => {
  const source = join(import.meta.dirname, "../node_modules/three/src/renderers");
  const renderer = readFileSync(join(source, "WebGLRenderer.js"), "utf8");
  const text = (part: string) => lean("", join(source, `${part}.js`));
  const goggles = text("webxr/WebXRManager");
  for (const asked of ["addEventListener", "removeEventListener", "setAnimationLoop", "dispose"]) {
    expect(renderer).toContain(`xr.${asked}(`);
    expect(goggles).toContain(`${asked}()`);
  }
  // all else is asked of goggles that are worn
  const others = renderer.match(/\bxr\.\w+\(/g)?.filter((call) => !goggles.includes(call.slice(3))) ?? [];
  expect([...new Set(others)].sort()).toEqual([
    "xr.getCamera(",
    "xr.getDepthSensingMesh(",
    "xr.hasDepthSensing(",
    "xr.updateCamera(",
  ]);
  expect(text("webgl/WebGLOutput")).toBe("export class WebGLOutput {}");
  expect(renderer.match(/\bnew WebGLOutput\(/g)).toHaveLength(1);
  expect(text("webgl/WebGLUniformsGroups")).toContain("dispose()");
});
