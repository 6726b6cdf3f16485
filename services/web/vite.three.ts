/** Build of three.js from its modules. */
import type { Plugin } from "vite";

/** Template literal with a shader. Its expressions contain no templates. */
const SHADER = /\/\* glsl \*\/\s*`((?:[^`$]|\$(?!\{)|\$\{[^`{}]*\})*)`/g;
const EXPRESSION = /\$\{[^}]*\}/g;

/**
 * Imports the modules of three.js instead of its prebuilt file, of which a build cannot leave parts to later chunks:
 * what only avatars need, such as animation and loaders, loads with them. Its shaders and those of the stage are
 * minified.
 */
export const threeModules: Plugin = {
  name: "three-modules",
  apply: "build",
  // Before comments are removed.
  enforce: "pre",
  config: () => ({ resolve: { alias: [{ find: /^three$/, replacement: "three/src/Three.js" }] } }),
  transform: {
    filter: { id: /\/three\/src\/.*\.js$|\/src\/stage\/.*\.ts$/, code: "/* glsl */" },
    handler: minifyShaders,
  },
};

/** Files that the loaders of three.js name as their defaults; ours name the ones that they use. */
const DEFAULT_FILE = /new URL\( '[^']*', import\.meta\.url \)\.toString\(\)/g;

/** Removes the default files of the loaders of compressed meshes and textures, of which most are never used. */
export const decoderFiles: Plugin = {
  name: "decoder-files",
  apply: "build",
  enforce: "pre",
  transform: { filter: { id: /\/loaders\/(?:KTX2|DRACO)Loader\.js$/ }, handler: removeDefaultFiles },
};

/** Replace the addresses of default files in the code of a loader by empty ones. */
export function removeDefaultFiles(code: string): string {
  return code.replace(DEFAULT_FILE, '""');
}

/** Minify the shaders in the code of a module. */
export function minifyShaders(code: string): string {
  return code.replace(SHADER, (_, shader: string) => {
    const expressions: string[] = [];
    const template = shader.replace(EXPRESSION, (expression) => `EXPRESSION_${expressions.push(expression) - 1}_`);
    return `\`${minifyShader(template).replace(/EXPRESSION_(\d+)_/g, (_, index) => expressions[Number(index)])}\``;
  });
}

/** Remove what a shader does not need: comments, indentation, empty lines, and spaces around operators. */
export function minifyShader(shader: string): string {
  return shader
    .replace(/\/\/.*/g, "")
    .replace(/\/\*.*?\*\//gs, "")
    .split(/\s*\n\s*/)
    .map((line) => (line.startsWith("#") ? line : removeSpaces(line)))
    .join("\n");
}

/** Remove the spaces of a line of code that separate no words and no signs. */
function removeSpaces(line: string): string {
  return line.replace(/(?<=[\w)\].]) ([-+]) (?=[\w(.])/g, "$1").replace(/\s*([*/%=<>!&|^?:;,(){}[\]])\s*/g, "$1");
}
