/** Build of three.js from its modules. */
import type { Plugin } from "vite";

/** Template literal with a shader. */
const SHADER = /\/\* glsl \*\/\s*`([^`$]*)`/g;

/**
 * Imports the modules of three.js instead of its prebuilt file, of which a build cannot leave parts to later chunks:
 * what only avatars need, such as animation and loaders, loads with them. Comments of the shaders are removed, as in
 * the prebuilt file.
 */
export const threeModules: Plugin = {
  name: "three-modules",
  apply: "build",
  config: () => ({ resolve: { alias: [{ find: /^three$/, replacement: "three/src/Three.js" }] } }),
  transform: {
    filter: { id: /\/three\/src\/.*\.glsl\.js$/ },
    handler: (code) => code.replace(SHADER, (_, shader: string) => `\`${removeComments(shader)}\``),
  },
};

/** Remove comments, indentation and empty lines of a shader. */
function removeComments(shader: string): string {
  return shader
    .replace(/\/\/.*/g, "")
    .replace(/\/\*.*?\*\//gs, "")
    .replace(/\s*\n\s*/g, "\n");
}
