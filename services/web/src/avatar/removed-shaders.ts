/**
 * Code of three.js's shaders that only avatars need. The build of the page removes it from the stage's shaders and puts
 * it here (`vite.shaders.ts`); other builds remove nothing.
 */

/** Removed code by the name of its chunk, in the order of the `#error` directives in its place. */
export const removedCode: Readonly<Record<string, readonly string[]>> = {};
/** Names of the chunks with the vertex and the fragment shader of the programs in `ShaderLib`. */
export const programs: Readonly<Record<string, readonly [vertex: string, fragment: string]>> = {};
