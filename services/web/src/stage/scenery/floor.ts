/**
 * Stage floor. Night: black lacquer planks with an analytic mirror of the backdrop (the view ray is reflected, and the
 * backdrop is evaluated where it lands), so that no second render pass is needed. Day: pale wood that fades into the
 * ground.
 */
import {
  type BufferAttribute,
  Color,
  type IUniform,
  Matrix4,
  Mesh,
  MeshStandardMaterial,
  type Object3D,
  PlaneGeometry,
  ShaderMaterial,
  UniformsLib,
  UniformsUtils,
  type Vector2,
  type WebGLProgramParametersWithUniforms,
} from "three";
import { CulledTriangles } from "../rendering/culled-triangles";
import { BACKDROP_GLSL, BACKDROP_Z_M, type BackdropUniforms } from "./backdrop";
import { BAKED_GLSL, type BakedUniforms } from "./baked-uniforms";
import { createDenseGrid } from "./dense-grid";
import type { Look } from "./look";
import { NOISE_GLSL } from "./noise";
import { REFLECTED_LIGHT_GLSL } from "./reflected-light";
import { updateVignette, VIGNETTE_GLSL, VIGNETTE_VERTEX_GLSL, type VignetteUniforms } from "./vignette";

/** Width and depth in metres. */
const SIZE_M = [26, 9] as const;

const SHADE_GLSL = /* glsl */ `
#include <opaque_fragment>
vec3 eye = normalize(mat3(intoRig) * (vPlace - cameraPosition));
vec2 at = (intoRig * vec4(vPlace, 1.)).xz;
vec2 board = at + travelled;
vec3 bounce = vec3(eye.x, -eye.y, eye.z);
float reach = (${BACKDROP_Z_M.toFixed(2)} - at.y) / min(bounce.z, -1e-3);
vec2 landing = vec2(at.x, 0.) + bounce.xy * reach;
float fresnel = .05 + .95 * pow(1. - abs(eye.y), 5.);
float grain = .6 * noise2(board * vec2(2., 26.)) + .4 * noise2(board * vec2(6., 90.));
float gap = smoothstep(.478, .497, abs(fract(board.x * 1.55) - .5));
vec3 mirrored = backdrop(landing + vec2((grain - .5) * .03, 0.), .10 + .05 * reach);
vec3 wood = gl_FragColor.rgb;
float horizon;
if (dark > .5) {
  wood *= (1. + .55 * (grain - .5)) * (1. - .6 * gap) * mix(.35, 1., exp(-.28 * dot(at, at)));
  wood += mirrored * (.9 * fresnel + .13) * (1. - .4 * gap) * .95;
  horizon = smoothstep(1.3, ${(0.2 - BACKDROP_Z_M).toFixed(2)}, -at.y + .22 * abs(at.x));
  if (horizon > 0.) wood = mix(wood, backdrop(vec2(at.x, .02), .06), horizon);
} else {
  wood *= (1. + .05 * (grain - .5)) * (1. - .10 * gap);
  wood = mix(wood, mirrored, .35 * fresnel);
  horizon = max(smoothstep(.5, 2.6, -at.y + .15 * abs(at.x)), .8 * smoothstep(.9, 3.4, length(at)));
}
gl_FragColor = vec4(wood, mix(opacityNear, 1., horizon));
`;

const HORIZON_GLSL = /* glsl */ `
#include <tonemapping_fragment>
if (dark < .5) gl_FragColor.rgb = mix(gl_FragColor.rgb, backdrop(vec2(at.x, -.2), .3), horizon);
`;

/**
 * Colours at the corners, displayed ones: a pixel is `vLit`, which boards darken, and `vUnlit`. `vBoards` has the place on
 * the boards, and how much grain and gaps change the light.
 */
const SIMPLE_VERTEX_GLSL = /* glsl */ `
#include <common>
#include <tonemapping_pars_fragment>
${REFLECTED_LIGHT_GLSL}
${BAKED_GLSL}
${VIGNETTE_VERTEX_GLSL}
uniform vec3 colour, vignetteColour; uniform float ambient, rough, dark; uniform mat4 intoRig; uniform vec2 travelled;
varying vec4 vBoards; varying vec3 vLit, vUnlit;
void main() {
  vec4 place = modelMatrix * vec4(position, 1.);
  vec4 seen = viewMatrix * place;
  gl_Position = projectionMatrix * seen;
  vec3 eye = normalize(mat3(intoRig) * (place.xyz - cameraPosition));
  vec2 at = (intoRig * place).xz;
  vec3 bounce = vec3(eye.x, -eye.y, eye.z);
  vec2 landing = vec2(at.x, 0.) + bounce.xy * (${BACKDROP_Z_M.toFixed(2)} - at.y) / min(bounce.z, -1e-3);
  float fresnel = .05 + .95 * pow(1. - abs(eye.y), 5.);
  vec3 wood = reflectedLight(seen.xyz, normalize(normalMatrix * normal), colour, ambient, rough)
    * mix(1., mix(.35, 1., exp(-.28 * dot(at, at))), dark);
  float mirror = mix(.35 * fresnel, .95 * (.9 * fresnel + .13), dark);
  // Displayed colours have about the roots of linear ones: their squares add up.
  wood = pow(ACESFilmicToneMapping(wood), vec3(2. / 2.2)) * (1. - mirror * (1. - dark));
  vec3 mirrored = texture2D(bakedBlurred, bakedPlace(landing)).rgb;
  vec3 sum = wood + mirror * mirrored * mirrored;
  float share = dot(wood, vec3(1.)) / max(dot(sum, vec3(1.)), 1e-4);
  float gapLoss = 1. - sqrt(1. - mix(.1, .6, dark) * share - .4 * dark * (1. - share));
  vBoards = vec4(at + travelled, .5 * mix(.05, .5, dark) * share, gapLoss);
  float horizon = mix(
    max(smoothstep(.5, 2.6, -at.y + .15 * abs(at.x)), .8 * smoothstep(.9, 3.4, length(at))),
    smoothstep(1.3, ${(0.2 - BACKDROP_Z_M).toFixed(2)}, -at.y + .22 * abs(at.x)),
    dark);
  vec3 far = texture2D(bakedBlurred, bakedPlace(vec2(at.x, mix(-.2, .02, dark)))).rgb;
  setVignette();
  vLit = sqrt(sum) * (1. - horizon) * (1. - vShade);
  vUnlit = mix(far * horizon, vignetteColour, vShade);
}`;
const SIMPLE_FRAGMENT_GLSL = /* glsl */ `
varying vec4 vBoards; varying vec3 vLit, vUnlit;
${NOISE_GLSL}
void main() {
  float grain = noise2(vBoards.xy * vec2(2., 26.)) - .5;
  float gap = smoothstep(.478, .497, abs(fract(vBoards.x * 1.55) - .5));
  gl_FragColor = vec4(vLit * (1. + vBoards.z * grain - vBoards.w * gap) + vUnlit, 1.);
}`;

/** Return the plane as a grid, which is denser where performers stand. */
function createGrid(): PlaneGeometry {
  const grid = createDenseGrid(SIZE_M, 56, 44, "upper");
  // Diagonals towards the centre in front, as lights gleam: across them their edges would be steps.
  const { array } = grid.index as BufferAttribute;
  for (let cell = 0; cell < array.length; cell += 6)
    if (grid.attributes.position.getX(array[cell]) < 0)
      [array[cell + 2], array[cell + 3]] = [array[cell + 4], array[cell]];
  return grid;
}

export interface Floor {
  readonly mesh: Mesh;
  /** Triangles of the grid for simple materials. */
  readonly triangles: CulledTriangles;
  /** Draws light and reflection from corner to corner of a grid, with a baked backdrop. */
  usesSimpleMaterials: boolean;
  applyLook(look: Look): void;
  dispose(): void;
}

/** Uniforms that the floor shares with other parts of the scenery. */
export interface FloorSurroundings {
  backdrop: BackdropUniforms;
  vignette: VignetteUniforms;
  baked: BakedUniforms;
}

/**
 * Create the floor. `rig` is the frame that it lies in, and `offset` the distance that the rig has travelled, for the
 * boards.
 */
export function createFloor({ backdrop, vignette, baked }: FloorSurroundings, rig: Object3D, offset: Vector2): Floor {
  const intoRig: IUniform<Matrix4> = { value: new Matrix4() };
  const opacityNear: IUniform<number> = { value: 1 };
  const colour: IUniform<Color> = { value: new Color() };
  const ambient: IUniform<number> = { value: 0 };
  const rough: IUniform<number> = { value: 1 };
  const placed = { ...vignette, travelled: { value: offset }, intoRig };
  const glossy = new MeshStandardMaterial({ transparent: true });
  glossy.onBeforeCompile = (shader) => patchShader(shader, { ...backdrop, ...placed, opacityNear });
  const simple = [
    new ShaderMaterial({
      uniforms: {
        ...UniformsUtils.clone(UniformsLib.lights),
        ...placed,
        ...baked,
        dark: backdrop.dark,
        colour,
        ambient,
        rough,
      },
      vertexShader: SIMPLE_VERTEX_GLSL,
      fragmentShader: SIMPLE_FRAGMENT_GLSL,
      lights: true,
      toneMapped: false,
    }),
  ];
  const [plane, grid] = [new PlaneGeometry(...SIZE_M), createGrid()];
  const triangles = new CulledTriangles(grid);
  const mesh = new Mesh<PlaneGeometry, MeshStandardMaterial | ShaderMaterial[]>(plane, glossy);
  mesh.name = "floor";
  mesh.rotation.x = -Math.PI / 2;
  mesh.position.z = BACKDROP_Z_M + SIZE_M[1] / 2;
  mesh.receiveShadow = true;
  mesh.renderOrder = 2;
  const fitVignette = updateVignette(vignette);
  mesh.onBeforeRender = (...parts) => {
    fitVignette(...parts);
    intoRig.value.copy(rig.matrixWorld).invert();
  };
  return {
    mesh,
    triangles,
    get usesSimpleMaterials() {
      return mesh.material === simple;
    },
    set usesSimpleMaterials(on) {
      mesh.material = on ? simple : glossy;
      mesh.geometry = on ? grid : plane;
    },
    applyLook({ floor }) {
      glossy.color.set(floor.colour);
      colour.value.set(floor.colour);
      ambient.value = floor.ambient;
      glossy.roughness = rough.value = floor.roughness;
      glossy.envMapIntensity = floor.environment;
      opacityNear.value = floor.opacity;
    },
    dispose() {
      for (const part of [plane, grid, glossy, ...simple]) part.dispose();
    },
  };
}

/** Add boards, reflection and vignette to the shader of three.js. */
function patchShader(shader: WebGLProgramParametersWithUniforms, uniforms: Record<string, IUniform>): void {
  Object.assign(shader.uniforms, uniforms);
  shader.vertexShader = shader.vertexShader
    .replace("#include <common>", "#include <common>\nvarying vec3 vPlace;")
    .replace("#include <fog_vertex>", "#include <fog_vertex>\nvPlace = (modelMatrix * vec4(transformed, 1.)).xyz;");
  shader.fragmentShader = shader.fragmentShader
    .replace(
      "#include <common>",
      `#include <common>
varying vec3 vPlace; uniform vec2 travelled; uniform mat4 intoRig; uniform float opacityNear;
${BACKDROP_GLSL}
${VIGNETTE_GLSL}`,
    )
    .replace("#include <opaque_fragment>", SHADE_GLSL)
    .replace("#include <tonemapping_fragment>", HORIZON_GLSL)
    .replace(
      "#include <colorspace_fragment>",
      "#include <colorspace_fragment>\ngl_FragColor.rgb = withVignette(gl_FragColor.rgb);",
    );
}
