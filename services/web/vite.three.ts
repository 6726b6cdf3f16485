/** Build of three.js from its modules. */
import type { Plugin } from "vite";

/** Template literal with a shader. */
const SHADER = /\/\* glsl \*\/\s*`([^`$]*)`/g;

/**
 * Imports the modules of three.js instead of its prebuilt file, of which a build cannot leave parts to later chunks:
 * what only avatars need, such as animation and loaders, loads with them. The shaders are minified.
 */
export const threeModules: Plugin = {
  name: "three-modules",
  apply: "build",
  config: () => ({ resolve: { alias: [{ find: /^three$/, replacement: "three/src/Three.js" }] } }),
  transform: {
    filter: { id: /\/three\/src\/.*\.glsl\.js$/ },
    handler: (code) => code.replace(SHADER, (_, shader: string) => `\`${minifyShader(shader)}\``),
  },
};

/** Remove what a shader does not need: comments, indentation, empty lines, and spaces around operators. */
export function minifyShader(shader: string): string {
  return shader
    .replace(/\/\/.*/g, "")
    .replace(/\/\*.*?\*\//gs, "")
    .trim()
    .split(/\s*\n\s*/)
    .map((line) => (line.startsWith("#") ? line : removeSpaces(line)))
    .join("\n");
}

/** Remove the spaces of a line of code that separate no words and no signs. */
function removeSpaces(line: string): string {
  return line.replace(/(?<=[\w)\].]) ([-+]) (?=[\w(.])/g, "$1").replace(/\s*([*/%=<>!&|^?:;,(){}[\]])\s*/g, "$1");
}
