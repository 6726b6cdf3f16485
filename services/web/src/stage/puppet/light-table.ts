/**
 * Table of the light that a performer's surfaces reflect, by finish and direction of the normal, for software
 * rendering: a fragment reads two texels instead of evaluating lights, lacquer and environment.
 *
 * The direction of view is taken as that of the picture's centre.
 */
import {
  type Camera,
  HalfFloatType,
  type IUniform,
  LinearFilter,
  Matrix4,
  type Scene,
  ShaderMaterial,
  type Texture,
  Vector3,
  type WebGLRenderer,
  WebGLRenderTarget,
} from "three";
import { FullScreenQuad } from "three/examples/jsm/postprocessing/Pass.js";
import type { Look } from "../scenery/look";
import { GLINT_GLSL } from "../scenery/reflected-light";
import { createStudioUniforms, STUDIO_GLSL, updateStudio } from "../scenery/studio-light";
import { createDistantLights, LIGHT_COUNT, updateDistantLights } from "./distant-lights";

/**
 * Finishes of the table: largest roughness for which one is used, its roughness, metalness and clearcoat. Gold is
 * rougher here, since the coarse mesh of a ring has few normals.
 */
const FINISHES = [
  [0.27, 0.45, 1, 0],
  [0.31, 0.28, 0, 0.9],
  [0.365, 0.5, 0.7, 0],
  [0.47, 0.42, 0, 0.35],
  [0.53, 0.5, 0, 0.2],
  [0.66, 0.61, 0, 0],
  [1, 0.72, 0, 0],
] as const;
const COUNT = FINISHES.length;
/** Width and height of the table of one finish. */
const TILE_PX = 24;
/** Radius of the disc of normals in a tile, as a share of the tile: beyond it is a border for interpolation. */
const DISC_RADIUS = 0.47;
/** Smallest change of a direction, in radians, or of a colour's light for which the table is drawn again. */
const TOLERANCE = 0.025;

const FINISHES_GLSL = FINISHES.map(([, ...finish]) => `vec3(${finish.map((value) => value.toFixed(2)).join()})`).join();
const TILE_GLSL = FINISHES.slice(0, -1)
  .map(([limit]) => `step(${limit.toFixed(3)}, roughness)`)
  .join("+");

/**
 * GLSL: `vec2 lightPlace(vec3 normal, float roughness)`, texture coordinates of the light that multiplies the colour;
 * that which is added to it is half the table's height above. `normal` is a unit vector in the view's frame.
 */
export const LIGHT_PLACE_GLSL = /* glsl */ `
vec2 lightPlace(vec3 normal, float roughness) {
  vec2 place = ${DISC_RADIUS} * normal.xy / (1. + max(normal.z, 0.)) + .5;
  return vec2((${TILE_GLSL} + place.x) / ${COUNT}., .5 * place.y);
}
`;

const FRAGMENT_GLSL = /* glsl */ `
uniform vec3 lightDirections[${LIGHT_COUNT}], lightColours[${LIGHT_COUNT}];
uniform mat4 fromView;
varying vec2 vPlace;
${STUDIO_GLSL}
${GLINT_GLSL}
/** Reflected shares of light from everywhere, by Karis: that which the colour at normal incidence scales, and more. */
vec2 shares(float roughness, float nv) {
  vec4 r = roughness * vec4(-1., -.0275, -.572, .022) + vec4(1., .0425, 1.04, -.04);
  return vec2(-1.04, 1.04) * (min(r.x * r.x, exp2(-9.28 * nv)) * r.x + r.y) + r.zw;
}
void main() {
  vec2 tile = vPlace * vec2(${COUNT}., 2.);
  vec3 finish = vec3[](${FINISHES_GLSL})[int(tile.x)];
  vec2 disc = (fract(tile) - .5) / ${DISC_RADIUS};
  float square = min(dot(disc, disc), 1.);
  vec3 normal = normalize(vec3(2. * disc, 1. - square));
  float nv = max(normal.z, .02), a = pow(finish.x, 4.), coatLoss = finish.z * (.04 + .96 * pow(1. - nv, 5.));
  vec3 world = mat3(fromView) * normal, bounce = mat3(fromView) * reflect(vec3(0., 0., -1.), normal);
  vec3 even = studio(world, 3.14), mirrored = studio(bounce, 12.57 * a * nv);
  vec2 share = shares(finish.x, nv), coatShare = shares(.16, nv);
  float shine = .04 * share.x + share.y;
  vec3 matt = even * (1. - shine), gloss = mirrored * shine, metal = mirrored * (share.x + share.y);
  vec3 coat = studio(bounce, .01 * nv) * (.04 * coatShare.x + coatShare.y);
  for (int i = 0; i < ${LIGHT_COUNT}; i++) {
    vec3 half_ = normalize(lightDirections[i] + vec3(0., 0., 1.)), light = lightColours[i];
    float nl = max(dot(normal, lightDirections[i]), 0.), nh = max(dot(normal, half_), 0.);
    float fresnel = .04 + .96 * pow(1. - half_.z, 5.);
    vec3 glints = light * glint(a, nl, nv, nh);
    matt += light * nl * (1. - fresnel);
    gloss += fresnel * glints;
    metal += glints;
    coat += light * fresnel * glint(.00066, nl, nv, nh);
  }
  vec3 light = tile.y < 1. ? mix(matt, metal, finish.y) : gloss * (1. - finish.y);
  gl_FragColor = vec4(light * (1. - coatLoss) + (tile.y < 1. ? vec3(0.) : finish.z * coat), 1.);
}`;

const place = new Vector3();

export class LightTable {
  readonly #target = new WebGLRenderTarget(TILE_PX * COUNT, TILE_PX * 2, {
    depthBuffer: false,
    type: HalfFloatType,
    minFilter: LinearFilter,
    magFilter: LinearFilter,
  });
  readonly #lights = createDistantLights();
  readonly #studio = createStudioUniforms();
  readonly #fromView: IUniform<Matrix4> = { value: new Matrix4() };
  readonly #material = new ShaderMaterial({
    uniforms: { ...this.#lights, ...this.#studio, fromView: this.#fromView },
    vertexShader: "varying vec2 vPlace; void main() { vPlace = uv; gl_Position = vec4(position.xy, 0., 1.); }",
    fragmentShader: FRAGMENT_GLSL,
    depthTest: false,
    depthWrite: false,
    toneMapped: false,
  });
  readonly #quad = new FullScreenQuad(this.#material);
  /** Numbers that the table was drawn for. */
  #drawn: readonly number[] = [];

  get texture(): Texture {
    return this.#target.texture;
  }

  /**
   * Draw the table for a performer whose root is at `root`, unless it is still right. World matrices are up to date.
   */
  update(renderer: WebGLRenderer, scene: Scene, camera: Camera, look: Look, root: Matrix4): void {
    updateDistantLights(this.#lights, scene, camera, place.setFromMatrixPosition(root));
    this.#fromView.value.copy(camera.matrixWorld);
    const { lightDirections, lightColours } = this.#lights;
    const numbers = [
      Number(look.dark),
      scene.environmentIntensity,
      ...lightDirections.value.flatMap((direction) => direction.toArray()),
      ...lightColours.value.flatMap((colour) => colour.toArray()),
    ];
    if (this.#drawn.length > 0 && numbers.every((value, at) => Math.abs(value - this.#drawn[at]) < TOLERANCE)) return;
    this.#drawn = numbers;
    updateStudio(this.#studio, look, scene);
    const target = renderer.getRenderTarget();
    const { enabled } = renderer.xr;
    // A session would replace the camera.
    renderer.xr.enabled = false;
    renderer.setRenderTarget(this.#target);
    this.#quad.render(renderer);
    renderer.setRenderTarget(target);
    renderer.xr.enabled = enabled;
  }

  /** Draw the table again at the next update: the context was lost. */
  invalidate(): void {
    this.#drawn = [];
  }

  dispose(): void {
    this.#target.dispose();
    this.#material.dispose();
  }
}
