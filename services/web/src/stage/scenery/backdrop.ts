/**
 * Backdrop: the disc of gold leaf on its ground, a plane behind the stage. The floor reflects the same GLSL function.
 */
import { type BufferAttribute, Color, type IUniform, Mesh, PlaneGeometry, ShaderMaterial, Vector2 } from "three";
import { CulledTriangles } from "../rendering/culled-triangles";
import { BAKED_GLSL, type BakedUniforms } from "./baked-uniforms";
import { createDenseGrid } from "./dense-grid";
import type { Look } from "./look";
import { NOISE_GLSL } from "./noise";
import { updateVignette, VIGNETTE_GLSL, VIGNETTE_VERTEX_GLSL, type VignetteUniforms } from "./vignette";

/** Position of the plane, in metres along z from the centre of the stage. */
export const BACKDROP_Z_M = -2.6;

/** Width and height of the plane in metres, and the height of its centre. */
const SIZE_M = [26, 14] as const;
const HEIGHT_M = 5;
const CENTRE_GLSL = `vec2(0., ${HEIGHT_M.toFixed(1)})`;
/** Indices of a grid's cell: two triangles. */
const CELL_INDICES = 6;

/**
 * Width of the ring around the disc that software rendering reads from a texture, in metres. Cells of the grid with no
 * corner within it do not touch the disc.
 */
const DISC_MARGIN_M = 0.4;

export interface BackdropUniforms {
  [name: string]: IUniform;
  discCentre: IUniform<Vector2>;
  discRadius: IUniform<number>;
}

/** GLSL: uniforms, and `vec3 backdrop(vec2 at, float blur)`, the linear colour at a position on the plane in metres. */
export const BACKDROP_GLSL = /* glsl */ `
uniform vec3 groundLow, groundMiddle, groundTop, leafDeep, leafBright;
uniform float leafStrength, dark, discRadius;
uniform vec2 discCentre;
${NOISE_GLSL}
vec3 backdrop(vec2 at, float blur) {
  float height = clamp((at.y + .2) / 4.2, 0., 1.);
  vec3 ground = mix(mix(groundLow, groundMiddle, smoothstep(0., .35, height)), groundTop, smoothstep(.35, 1., height));
  float paper = .6 * noise2(at * vec2(3., 4.)) + .4 * noise2(at * vec2(13., 17.));
  ground *= 1. + (paper - .5) * mix(.05, .09, dark) * (blur > .2 ? .3 : 1.);

  vec2 fromCentre = at - discCentre;
  float away = length(fromCentre);
  // The disc itself has fine detail; its blurred reflection in the floor has none.
  if (blur < .05) away += .003 * (noise2(at * 9.) - .5) + .0025 * (noise2(at * 41.) - .5);
  float inside = 1. - smoothstep(discRadius - .004 - blur, discRadius + .004 + blur, away);
  vec3 halo = leafDeep * exp(-2.2 * max(away - discRadius, 0.)) * (1. - inside) * .055 * dark;
  if (inside <= 0.) return ground + halo;

  vec2 square = at * 3.3 + vec2(.3, .1) + .05 * (noise2(at * 6.) - .5);
  vec2 edge = abs(fract(square) - .5);
  float seam = smoothstep(.47, .497, max(edge.x, edge.y));
  float tone = .34 * hash2(floor(square) + 7.) - .17;
  float cloud = .7 * noise2(at * 2.1 + 3.) + .3 * noise2(at * 9.);
  vec3 leaf = mix(leafDeep, leafBright, clamp(.15 + .7 * cloud + tone, 0., 1.))
    * (1. + (blur < .05 ? .07 * seam * dark : 0.));
  leaf *= mix(1., smoothstep(1.9, .1, length(fromCentre - vec2(-.35, .45))), .75 * dark);
  leaf *= mix(1., smoothstep(-.2, 1.1, at.y), .55 * dark);
  return mix(ground, leaf, inside * leafStrength) + halo;
}
`;

export function createBackdropUniforms(): BackdropUniforms {
  return {
    groundLow: { value: new Color() },
    groundMiddle: { value: new Color() },
    groundTop: { value: new Color() },
    leafDeep: { value: new Color() },
    leafBright: { value: new Color() },
    leafStrength: { value: 1 },
    dark: { value: 1 },
    discRadius: { value: 1.06 },
    discCentre: { value: new Vector2(0, 1.3) },
  };
}

export function applyLookToBackdrop(uniforms: BackdropUniforms, look: Look): void {
  (uniforms.groundLow.value as Color).set(look.backdrop.low);
  (uniforms.groundMiddle.value as Color).set(look.backdrop.middle);
  (uniforms.groundTop.value as Color).set(look.backdrop.top);
  (uniforms.leafDeep.value as Color).set(look.disc.deep);
  (uniforms.leafBright.value as Color).set(look.disc.bright);
  uniforms.leafStrength.value = look.disc.strength;
  uniforms.dark.value = look.dark ? 1 : 0;
}

/**
 * GLSL for materials that three.js does not map tones of: `vec3 displayedBackdrop(vec2 at, float blur)`. In the day
 * look it is not tone mapped: the film curve would grey the paper.
 */
export const DISPLAYED_BACKDROP_GLSL = /* glsl */ `
#include <tonemapping_pars_fragment>
${BACKDROP_GLSL}
vec3 displayedBackdrop(vec2 at, float blur) {
  vec3 paper = backdrop(at, blur);
  return sRGBTransferOETF(vec4(mix(paper, ACESFilmicToneMapping(paper), dark), 1.)).rgb;
}
`;

export interface Backdrop {
  readonly mesh: Mesh;
  /** Triangles of the grid for simple materials. */
  readonly triangles: CulledTriangles;
  /** Draws the baked function. */
  usesSimpleMaterials: boolean;
  /** Follow a change of the disc's position or radius. */
  fitDisc(): void;
  dispose(): void;
}

/** Create the plane, in the frame of the rig that follows the performers. */
export function createBackdrop(uniforms: BackdropUniforms, vignette: VignetteUniforms, baked: BakedUniforms): Backdrop {
  const detailed = new ShaderMaterial({
    uniforms: { ...uniforms, ...vignette },
    depthWrite: false,
    toneMapped: false,
    vertexShader: VERTEX_GLSL,
    fragmentShader: FRAGMENT_GLSL,
  });
  // Two materials, since without a graphics processor branches save nothing: the disc has a texture, the ground does not.
  const simple = [SIMPLE_DISC, SIMPLE_GROUND].map(
    (shaders) =>
      new ShaderMaterial({
        uniforms: { ...uniforms, ...vignette, ...baked },
        depthWrite: false,
        toneMapped: false,
        ...shaders,
      }),
  );
  const [plane, grid] = [new PlaneGeometry(...SIZE_M), createDenseGrid(SIZE_M, 48, 28, "lower")];
  const { position } = grid.attributes;
  const cells = Array.from((grid.index as BufferAttribute).array);
  const triangles = new CulledTriangles(grid);
  const mesh = new Mesh<PlaneGeometry, ShaderMaterial | ShaderMaterial[]>(plane, detailed);
  mesh.name = "backdrop";
  mesh.position.set(0, HEIGHT_M, BACKDROP_Z_M);
  mesh.onBeforeRender = updateVignette(vignette);
  const backdrop = {
    mesh,
    triangles,
    get usesSimpleMaterials() {
      return mesh.material === simple;
    },
    set usesSimpleMaterials(on) {
      mesh.material = on ? simple : detailed;
      mesh.geometry = on ? grid : plane;
      // The reflection is drawn over it and shows through the floor; without one, it is drawn only where nothing covers
      // it.
      mesh.renderOrder = on ? 3 : -5;
    },
    fitDisc() {
      const { discCentre, discRadius } = uniforms;
      triangles.triangles = splitCells(cells, (corner) => {
        const [x, y] = [position.getX(corner), position.getY(corner) + HEIGHT_M];
        return Math.hypot(x - discCentre.value.x, y - discCentre.value.y) < discRadius.value + DISC_MARGIN_M;
      });
    },
    dispose() {
      for (const part of [plane, grid, detailed, ...simple]) part.dispose();
    },
  };
  backdrop.usesSimpleMaterials = false;
  backdrop.fitDisc();
  return backdrop;
}

/**
 * Divide the cells of a grid, given by the corners of their triangles, into two groups: those with a corner for which
 * `isInside` is true, and the others.
 */
function splitCells(cells: readonly number[], isInside: (corner: number) => boolean): [number[], number[]] {
  const [inside, outside]: [number[], number[]] = [[], []];
  for (let at = 0; at < cells.length; at += CELL_INDICES) {
    const cell = cells.slice(at, at + CELL_INDICES);
    (cell.some(isInside) ? inside : outside).push(...cell);
  }
  return [inside, outside];
}

const VERTEX_GLSL = /* glsl */ `
varying vec2 vAt;
void main() {
  vAt = position.xy + ${CENTRE_GLSL};
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.);
}`;
const FRAGMENT_GLSL = /* glsl */ `
${DISPLAYED_BACKDROP_GLSL}
${VIGNETTE_GLSL}
varying vec2 vAt;
void main() {
  gl_FragColor = vec4(withVignette(displayedBackdrop(vAt, 0.)) + (hash2(gl_FragCoord.xy) - .5) / 160., 1.);
}`;
const SIMPLE_DISC = {
  vertexShader: /* glsl */ `
${BAKED_GLSL}
${VIGNETTE_VERTEX_GLSL}
varying vec2 vPlace;
void main() {
  vPlace = bakedPlace(position.xy + ${CENTRE_GLSL});
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.);
  setVignette();
}`,
  fragmentShader: /* glsl */ `
${BAKED_GLSL}
uniform vec3 vignetteColour;
varying vec2 vPlace; varying float vShade;
void main() { gl_FragColor = vec4(mix(texture2D(bakedSharp, vPlace).rgb, vignetteColour, vShade), 1.); }`,
};
const SIMPLE_GROUND = {
  vertexShader: /* glsl */ `
${BAKED_GLSL}
${VIGNETTE_VERTEX_GLSL}
uniform vec3 vignetteColour;
varying vec3 vColour;
void main() {
  gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.);
  setVignette();
  vColour = mix(texture2D(bakedSharp, bakedPlace(position.xy + ${CENTRE_GLSL})).rgb, vignetteColour, vShade);
}`,
  fragmentShader: "varying vec3 vColour; void main() { gl_FragColor = vec4(vColour, 1.); }",
};
