/** Shaders of three.js without the code that only avatars need. That code loads with the first avatar. */
import { ShaderChunk } from "three/src/renderers/shaders/ShaderChunk.js";
import { ShaderLib } from "three/src/renderers/shaders/ShaderLib.js";
import type { Plugin } from "vite";
import { minifyShader } from "./vite.three.ts";

/** Shaders that the stage uses: of its materials, shadows and environment, and what three.js adds to every shader. */
const STAGE_CHUNKS = [
  "meshphysical_vert",
  "meshphysical_frag",
  "meshbasic_vert",
  "meshbasic_frag",
  "depth_vert",
  "depth_frag",
  "cube_vert",
  "tonemapping_pars_fragment",
  "colorspace_pars_fragment",
];

/** Macros that no material of the stage defines, and counts that are always 0 on it. */
const AVATAR_MACROS = new Set(
  `USE_MAP USE_ALPHAMAP USE_AOMAP USE_LIGHTMAP USE_EMISSIVEMAP USE_BUMPMAP USE_DISPLACEMENTMAP USE_ROUGHNESSMAP
  USE_METALNESSMAP USE_SPECULARMAP USE_SPECULAR_COLORMAP USE_SPECULAR_INTENSITYMAP USE_CLEARCOATMAP
  USE_CLEARCOAT_ROUGHNESSMAP USE_CLEARCOAT_NORMALMAP USE_NORMALMAP USE_NORMALMAP_OBJECTSPACE USE_NORMALMAP_TANGENTSPACE
  USE_TANGENT USE_ALPHATEST USE_ALPHAHASH ALPHA_TO_COVERAGE DITHERING USE_FOG USE_LOGARITHMIC_DEPTH_BUFFER
  USE_TRANSMISSION USE_TRANSMISSIONMAP USE_THICKNESSMAP USE_DISPERSION USE_IRIDESCENCE USE_IRIDESCENCEMAP
  USE_IRIDESCENCE_THICKNESSMAP USE_SHEEN USE_SHEEN_COLORMAP USE_SHEEN_ROUGHNESSMAP USE_ANISOTROPY USE_ANISOTROPYMAP
  USE_RETROREFLECTION USE_DIFFUSE_ROUGHNESS USE_DIFFUSE_ROUGHNESSMAP USE_MORPHTARGETS USE_MORPHNORMALS USE_MORPHCOLORS
  USE_INSTANCING_COLOR USE_INSTANCING_MORPH USE_BATCHING USE_BATCHING_COLOR USE_POINTS_UV
  ENVMAP_TYPE_CUBE SHADOWMAP_TYPE_VSM NUM_CLIPPING_PLANES NUM_POINT_LIGHTS NUM_POINT_LIGHT_SHADOWS
  NUM_RECT_AREA_LIGHTS NUM_HEMI_LIGHTS NUM_SUN_LIGHTS NUM_SUN_LIGHT_SHADOWS NUM_LIGHT_PROBE_GRIDS NUM_SPOT_LIGHT_MAPS
  NUM_DIR_LIGHT_SHADOWS`.split(/\s+/),
);

/** Stands for removed code. It makes the shader of a material invalid that needs the code. */
const PLACEHOLDER = "#error";

const CONDITION = /^#(ifdef|ifndef|if|elif|else|endif)\b(.*)$/;

/** A shader chunk and the code that was removed from it, in the order of its placeholders. */
export interface SplitChunk {
  readonly kept: string;
  readonly removed: readonly string[];
}

/** Remove the code of a minified chunk that needs a macro of avatars. */
export function splitChunk(chunk: string): SplitChunk {
  const kept: string[] = [];
  const removed: string[][] = [];
  /** Number of open conditions within the code being removed; null if the code is kept. */
  let depth: number | null = null;
  for (const line of chunk.split("\n")) {
    const [, directive = "", expression = ""] = CONDITION.exec(line) ?? [];
    if (depth !== null) {
      if (depth === 0 && /^(elif|else|endif)$/.test(directive)) depth = null;
      else if (directive.startsWith("if")) depth++;
      else if (directive === "endif") depth--;
    }
    if (depth !== null) removed.at(-1)?.push(line);
    else kept.push(line);
    if (depth !== null || !isFalseOnStage(directive, expression)) continue;
    depth = 0;
    kept.push(PLACEHOLDER);
    removed.push([]);
  }
  return { kept: kept.join("\n"), removed: removed.map((lines) => lines.join("\n")) };
}

/** Return whether a condition needs a macro of avatars. It may return false for complex conditions that do. */
function isFalseOnStage(directive: string, expression: string): boolean {
  if (directive === "ifdef") return AVATAR_MACROS.has(expression.trim());
  if ((directive !== "if" && directive !== "elif") || /\([^)]*\|\|/.test(expression)) return false;
  return expression.split("||").every((alternative) => alternative.split("&&").some(isFalseTerm));
}

/** Return whether a term is `defined( MACRO )` or `COUNT > 0` of a macro of avatars. */
function isFalseTerm(term: string): boolean {
  const [, macro, count] = /^[\s(]*(?:defined\s*\(\s*(\w+)|(\w+)\s*>\s*0)[\s)]*$/.exec(term) ?? [];
  return AVATAR_MACROS.has(macro ?? count ?? "");
}

/** Return the chunks of three.js, minified, by name. Chunks that the stage never includes are removed as a whole. */
export function splitChunks(): Record<string, SplitChunk> {
  const included = new Set(STAGE_CHUNKS);
  // The iteration also visits what is added meanwhile.
  for (const name of included)
    for (const [, other] of SHADER_CHUNKS[name].matchAll(/#include +<(\w+)>/g)) included.add(other);
  return Object.fromEntries(
    Object.entries(SHADER_CHUNKS).map(([name, source]) => {
      const chunk = minifyShader(source).trim();
      return [name, included.has(name) ? splitChunk(chunk) : { kept: PLACEHOLDER, removed: [chunk] }];
    }),
  );
}

const SHADER_CHUNKS: Readonly<Record<string, string>> = ShaderChunk;

/** Return the names of the chunks with the vertex and the fragment shader of each program in `ShaderLib`. */
function findPrograms(): Record<string, [string, string]> {
  const nameOf = new Map(Object.entries(SHADER_CHUNKS).map(([name, source]) => [source, name]));
  const find = (source: string) => nameOf.get(source) ?? raise(`Shader of three.js is not a chunk: ${source}`);
  return Object.fromEntries(
    Object.entries(ShaderLib).map(([id, { vertexShader, fragmentShader }]) => [
      id,
      [find(vertexShader), find(fragmentShader)],
    ]),
  );
}

function raise(message: string): never {
  throw new Error(message);
}

/** Splits the shaders of three.js: `src/avatar/removed-shaders.ts` gets the code that only avatars need. */
export const avatarShaders: Plugin = {
  name: "avatar-shaders",
  apply: "build",
  transform: {
    filter: { id: /\/three\/src\/renderers\/shaders\/ShaderChunk\.js$|\/src\/avatar\/removed-shaders\.ts$/ },
    handler: (_, id) => {
      const chunks = Object.entries(splitChunks());
      if (id.endsWith("ShaderChunk.js"))
        return `export const ShaderChunk = ${JSON.stringify(Object.fromEntries(chunks.map(([name, { kept }]) => [name, kept])))};`;
      const removed = chunks.flatMap(([name, chunk]) => (chunk.removed.length > 0 ? [[name, chunk.removed]] : []));
      return `export const removedCode = ${JSON.stringify(Object.fromEntries(removed))};
        export const programs = ${JSON.stringify(findPrograms())};`;
    },
  },
};
