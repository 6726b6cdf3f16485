/** three.js is built in from its single files, so that what no part of the page uses stays away, members of classes too, and what only a late part uses comes with that. */
import { build, type Plugin, type ResolvedConfig, type Rolldown } from "vite";
import { unusedMembers, withoutMembers } from "./unused-members.ts";

/**
 * Texts of shaders that stay away: materials that nothing on the stage is made of, and what others include for features that
 * it has not, which stands behind an `#ifdef` of the feature.
 */
const UNUSED =
  /\/((mesh|lights_)(phong|toon|matcap|normal)|(gradientmap|sprite|linedashed|distance|equirect|background|map_particle|transmission|iridescence|lightprobes|batching|fog|displacementmap|bumpmap|alphahash|alphamap|clipping_planes|logdepthbuf|lightmap|dithering)|envmap_(fragment|vertex|pars)|shadow(?=\.))[^/]*\.glsl\.js$/;

const SHADER = /\/\* glsl \*\/\s*`([^`$]*)`/g;

/** Parts of the renderer for what the stage never does: goggles, other outputs than the canvas, blocks of uniforms. What the renderer asks of them all the same is answered. */
const IDLE: Readonly<Record<string, string>> = {
  "webxr/WebXRManager":
    "export class WebXRManager { enabled = false; isPresenting = false; addEventListener() {} removeEventListener() {} setAnimationLoop() {} getEnvironmentBlendMode() {} dispose() {} }",
  "webgl/WebGLOutput": "export class WebGLOutput {}",
  "webgl/WebGLUniformsGroups": "export class WebGLUniformsGroups { dispose() {} }",
};

/** A shader's text without what is there for its readers. Lines of the preprocessor keep their spaces, and so do signs, of which two in a row are another. */
function plain(text: string): string {
  const lines = text
    .replace(/\/\*[\s\S]*?\*\/|\/\/.*/g, "")
    .replace(/\s*\n\s*/g, "\n")
    .split("\n");
  return lines
    .map((line) =>
      line.startsWith("#") ? line : line.replace(/\s+/g, " ").replace(/ ?([,;(){}[\]=<>*/?:&|]) ?/g, "$1"),
    )
    .join("\n");
}

/** A file of three.js with its shaders' texts made small; `id` is its path. */
export function lean(code: string, id: string): string {
  const idle = Object.keys(IDLE).find((name) => id.endsWith(`/renderers/${name}.js`));
  if (idle) return IDLE[idle];
  return code.replace(SHADER, (_, text: string) => JSON.stringify(UNUSED.test(id) ? "" : plain(text)));
}

const THREE = /\/three\/src\//;

/** The mode of a build that is not written: it tells what is built in. */
const STUDY = "study";

let config: ResolvedConfig;
/** Names of members that nothing built in says. */
let unused: ReadonlySet<string> = new Set();

export const leanThree: Plugin = {
  name: "lean-three",
  apply: "build",
  enforce: "pre",
  configResolved(resolved) {
    config = resolved;
  },
  async buildStart() {
    if (config.mode === STUDY) return;
    const { configFile, root } = config;
    const { output } = (await build({
      configFile: configFile ?? false,
      root,
      mode: STUDY,
      logLevel: "silent",
      build: { write: false, minify: false },
    })) as Rolldown.RolldownOutput;
    const modules = output.flatMap((file) => (file.type === "chunk" ? Object.entries(file.modules) : []));
    unused = unusedMembers(modules.map(([id, { code }]) => ({ code: code ?? "", cuttable: THREE.test(id) })));
  },
  resolveId(id, importer) {
    return id === "three" ? this.resolve("three/src/Three.js", importer, { skipSelf: true }) : null;
  },
  transform: {
    filter: { id: THREE },
    handler: (code, id) => ({ code: withoutMembers(lean(code, id), unused), map: null }),
  },
};
