/** three.js is built in from its single files, so that what no part of the page uses stays away, and what only a late part uses comes with that. */
import type { Plugin } from "vite";

/**
 * Texts of shaders that stay away: materials that nothing on the stage is made of, and what others include for features that
 * it has not, which stands behind an `#ifdef` of the feature.
 */
const UNUSED =
  /\/((mesh|lights_)(phong|toon|matcap|normal)|(gradientmap|sprite|linedashed|distance|equirect|background|map_particle|transmission|iridescence|lightprobes|batching|fog|displacementmap|bumpmap|alphahash|alphamap|clipping_planes|logdepthbuf|lightmap|dithering)|envmap_(fragment|vertex|pars)|shadow(?=\.))[^/]*\.glsl\.js$/;

const SHADER = /\/\* glsl \*\/\s*`([^`$]*)`/g;

/** A shader's text without what is there for its readers. */
function plain(text: string): string {
  return text.replace(/\/\*[\s\S]*?\*\/|\/\/.*/g, "").replace(/\s*\n\s*/g, "\n");
}

/** A file of three.js with its shaders' texts made small; `id` is its path. */
export function lean(code: string, id: string): string {
  return code.replace(SHADER, (_, text: string) => JSON.stringify(UNUSED.test(id) ? "" : plain(text)));
}

export const leanThree: Plugin = {
  name: "lean-three",
  apply: "build",
  enforce: "pre",
  resolveId(id, importer) {
    return id === "three" ? this.resolve("three/src/Three.js", importer, { skipSelf: true }) : null;
  },
  transform: {
    filter: { id: /\/three\/src\// },
    handler: (code, id) => ({ code: lean(code, id), map: null }),
  },
};
