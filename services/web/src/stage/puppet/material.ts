/** The puppet's material: three.js's physical shading, with finish, pattern and wood from vertex attributes. */
import { BackSide, type IUniform, MeshPhysicalMaterial, type Texture } from "three";
import { NOISE_GLSL } from "../scenery/noise";
import { FACE_PAINT_GLSL } from "./face/face-paint";

const VERTEX_HEADER_GLSL = /* glsl */ `
attribute vec4 finish; attribute vec3 pattern;
varying vec4 vFinish; varying vec3 vPattern; varying vec3 vRest; varying float vSeed, vFront;
`;
export const FRAGMENT_HEADER_GLSL = /* glsl */ `
varying vec3 vPattern;
#ifdef PLAIN
varying vec4 vSolid;
#define vRest vSolid.xyz
#define vSeed 0.
#define vFront vSolid.w
#define vFinish vec4(0., 0., 0., vPattern.z < .5 ? vSolid.w : 0.)
#else
varying vec4 vFinish; varying vec3 vRest; varying float vSeed, vFront;
#endif
uniform sampler2D facePaint; uniform sampler2D hempLeaf;
${NOISE_GLSL}
#ifndef FACELESS
${FACE_PAINT_GLSL}
#endif
`;

/** Offset of the timber from one bone to the next. */
export const WOOD_SEED_GLSL = "vec3(.37, 1.3, .71)";

/**
 * Growth rings, fibres and pores from the position in the rest pose; `vSeed` gives each bone a different timber. With
 * `PLAIN`, rings alone.
 */
const WOOD_GLSL = /* glsl */ `
if (vFinish.w > 0.) {
  vec3 q = vRest + vSeed * ${WOOD_SEED_GLSL};
  float warp = 1.6 * noise3(q * vec3(7., 1.6, 7.)), fibre = .5, pore = 0.;
#ifndef PLAIN
  warp += .35 * noise3(q * vec3(22., 3., 22.));
  fibre = noise3(q * vec3(520., 14., 520.));
  pore = smoothstep(.74, .9, noise3(q * vec3(300., 9., 300.)));
#else
  warp += .175;
#endif
  float ring = fract(.5 * (85. * length(q.xz - floor(q.xz * 2.) * .5 - vec2(.33, .18)) + 5. * warp));
  ring = smoothstep(0., .75, ring) * smoothstep(1., .86, ring);
  diffuseColor.rgb = mix(diffuseColor.rgb, diffuseColor.rgb * vec3(.62, .50, .40),
    vFinish.w * (.46 * ring + .25 * pore));
  diffuseColor.rgb *= 1. + vFinish.w * .14 * (fibre - .5);
  roughen = vFinish.w * (.10 * ring + .15 * pore);
}
`;

/**
 * Skinning without the bones that have no weight: most of the figure is rigid, and each bone costs four texture reads.
 * The mesh is bound where it is modelled, so its bind matrices are identities.
 */
const SKIN_MATRIX_GLSL = /* glsl */ `
mat4 skin = getBoneMatrix(skinIndex.x);
if (skinWeight.x < 1.) {
  skin = skin * skinWeight.x + getBoneMatrix(skinIndex.y) * skinWeight.y;
  if (skinWeight.z > 0.) skin += getBoneMatrix(skinIndex.z) * skinWeight.z + getBoneMatrix(skinIndex.w) * skinWeight.w;
}
`;

/** Values of PATTERN in finish.ts: 1 face, 2 asanoha, 3 weave, 4 stripe. With `FACELESS`, there is no face. */
export const COLOUR_GLSL = /* glsl */ `
float roughen = 0.;
#ifdef PLAIN
float thread = 1.;
#else
float thread = .93 + .14 * noise2(vPattern.xy * vec2(900., 220.));
#endif
if (vPattern.z > 3.5) {
  float at = vPattern.x * 62., blur = 1.5 * fwidth(at);
  float stripe = smoothstep(.8 - blur, .8 + blur, 2. * abs(fract(at) - .5)) * (1. - clamp(.7 * blur, 0., .8));
  diffuseColor.rgb = mix(diffuseColor.rgb, 1.7 * diffuseColor.rgb + vec3(.016, .014, .011), .45 * stripe);
  diffuseColor.rgb *= thread;
} else if (vPattern.z > 2.5) {
  diffuseColor.rgb *= .86 + .22 * smoothstep(.5, .62, 2. * abs(fract(vPattern.y * 46.) - .5));
} else if (vPattern.z > 1.5) {
  vec2 place = vPattern.xy * 11.;
  #ifdef PLAIN
  // With a level given, the texture is not read anisotropically, which takes several times as long.
  vec2 texels = 512. * fwidth(place);
  float line = textureLod(hempLeaf, place, .5 * log2(texels.x * texels.y + 1.) - .8).r;
  #else
  float line = texture2D(hempLeaf, place).r;
  #endif
  diffuseColor.rgb = mix(diffuseColor.rgb, 2.2 * diffuseColor.rgb + vec3(.045, .055, .075), .62 * line);
  diffuseColor.rgb *= thread;
#ifndef FACELESS
} else if (vPattern.z > .5) {
  float front = smoothstep(.2, .5, vFront);
  diffuseColor.rgb *= mix(vec3(1.), paintFace(vPattern.xy), front);
#endif
}
${WOOD_GLSL}
`;

function patchVertexShader(shader: { vertexShader: string }): void {
  shader.vertexShader = shader.vertexShader
    .replace("#include <skinbase_vertex>", SKIN_MATRIX_GLSL)
    .replace("#include <skinnormal_vertex>", "objectNormal = mat3(skin) * objectNormal;")
    .replace("#include <skinning_vertex>", "transformed = (skin * vec4(transformed, 1.)).xyz;")
    .replace("#include <common>", `#include <common>\n${VERTEX_HEADER_GLSL}`)
    .replace(
      "#include <begin_vertex>",
      `#include <begin_vertex>
vFinish = finish; vPattern = pattern; vRest = position; vSeed = skinIndex.x; vFront = normal.z;`,
    );
}

export interface PuppetTextures {
  face: Texture;
  asanoha: Texture;
}

/**
 * Create the figure's material. With `mirrorHeight` it draws the mesh upside down below a floor at that height (a
 * uniform shared with the floor) and fades with the distance to the floor.
 */
export function createFigureMaterial(textures: PuppetTextures, mirrorHeight?: IUniform<number>): MeshPhysicalMaterial {
  const material = new MeshPhysicalMaterial({
    vertexColors: true,
    roughness: 1,
    metalness: 1,
    clearcoat: 1,
    clearcoatRoughness: 0.16,
  });
  if (mirrorHeight) {
    material.side = BackSide;
    material.clearcoat = 0.001;
  }
  material.customProgramCacheKey = () => (mirrorHeight ? "figure-mirrored" : "figure");
  material.onBeforeCompile = (shader) => {
    Object.assign(shader.uniforms, { facePaint: { value: textures.face }, hempLeaf: { value: textures.asanoha } });
    if (mirrorHeight) shader.uniforms.floorAt = mirrorHeight;
    patchVertexShader(shader);
    shader.fragmentShader = shader.fragmentShader
      .replace(
        "#include <common>",
        `#include <common>\n${FRAGMENT_HEADER_GLSL}${mirrorHeight ? "varying float vHeight;\n" : ""}`,
      )
      .replace("#include <color_fragment>", `#include <color_fragment>\n${COLOUR_GLSL}`)
      .replace("#include <roughnessmap_fragment>", "float roughnessFactor = clamp(vFinish.x + roughen, .05, 1.);")
      .replace("#include <metalnessmap_fragment>", "float metalnessFactor = vFinish.y;")
      .replace(
        "#include <lights_physical_fragment>",
        "#include <lights_physical_fragment>\nmaterial.clearcoat *= vFinish.z;",
      );
    if (!mirrorHeight) return;
    shader.vertexShader = shader.vertexShader
      .replace("#include <common>", "#include <common>\nvarying float vHeight; uniform float floorAt;")
      .replace(
        "#include <fog_vertex>",
        `#include <fog_vertex>
      vec4 above = modelMatrix * vec4(transformed, 1.);
      vHeight = above.y - floorAt;
      above.y = floorAt - vHeight;
      gl_Position = projectionMatrix * viewMatrix * above;`,
      );
    shader.fragmentShader = shader.fragmentShader.replace(
      "#include <opaque_fragment>",
      "#include <opaque_fragment>\ngl_FragColor.rgb *= exp(-2.1 * max(vHeight, 0.));",
    );
  };
  return material;
}
