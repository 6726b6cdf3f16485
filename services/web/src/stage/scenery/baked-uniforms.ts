/** Textures of the backdrop for software rendering, and how shaders read them. */
import type { IUniform, Texture } from "three";

/** Area of the backdrop's plane that the textures show, in metres; beyond it their edges continue. */
const LEFT_M = -5.2;
const BOTTOM_M = -0.8;
const WIDTH_M = 10.4;
const HEIGHT_M = 5.2;

export interface BakedUniforms {
  [name: string]: IUniform;
  bakedSharp: IUniform<Texture | null>;
  /** Backdrop as the floor reflects it. */
  bakedBlurred: IUniform<Texture | null>;
}

export function createBakedUniforms(): BakedUniforms {
  return { bakedSharp: { value: null }, bakedBlurred: { value: null } };
}

const CORNER_GLSL = `vec2(${LEFT_M.toFixed(1)}, ${BOTTOM_M.toFixed(1)})`;
const SIZE_GLSL = `vec2(${WIDTH_M.toFixed(1)}, ${HEIGHT_M.toFixed(1)})`;

/** GLSL: texture coordinates of a position on the plane in metres, and the position of texture coordinates. */
export const BAKED_GLSL = /* glsl */ `
uniform sampler2D bakedSharp, bakedBlurred;
vec2 bakedPlace(vec2 at) { return (at - ${CORNER_GLSL}) / ${SIZE_GLSL}; }
vec2 unbakedPlace(vec2 place) { return place * ${SIZE_GLSL} + ${CORNER_GLSL}; }
`;
