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
    if (!/= ""|default ""/.test(after)) expect(after.match(/#(if|endif)/g)).toEqual(before.replace(/\/\*[^`]*?\*\/|\/\/.*/g, "").match(/#(if|endif)/g));
  }
});

test("what the stage and its guests are made of stays, what nothing is made of goes", () => {
  const empty = [...built("ShaderLib")].filter(([, { after }]) => /vertex = ""/.test(after)).map(([name]) => name);
  expect(empty.sort()).toEqual(["background", "backgroundCube", "distance", "equirect", "linedashed", "meshmatcap", "meshnormal", "meshphong", "meshtoon", "shadow", "sprite"]);
});

test("what is left out of the parts is nothing without a feature that the stage has not", () => {
  for (const [name, { before, after }] of built("ShaderChunk")) {
    if (!/default ""/.test(after)) continue;
    // for a compiler it begins with a condition and ends with it, or it belongs to a material that is left out
    const text = before.replace(/\/\/.*/g, "").replace(/^[^`]*`|`[^`]*$/g, "").trim();
    expect(/^#if[\s\S]*#endif$/.test(text) || /toon|phong|gradientmap/.test(name), name).toBe(true);
  }
});
