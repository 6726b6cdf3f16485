/**
 * Darker corners of the picture. Scenery draws them itself: a layer of the page over the whole stage would be blended
 * with each frame, which halves the frames that a machine without a graphics processor shows of an empty canvas.
 */
import { Color, type IUniform, type Object3D, Vector2, type WebGLRenderer } from "three";
import type { Look } from "./look";

export interface VignetteUniforms {
  [name: string]: IUniform;
  pictureSize: IUniform<Vector2>;
  vignetteColour: IUniform<Color>;
  vignetteStrength: IUniform<number>;
  vignetteStart: IUniform<number>;
}

/** GLSL: `float shadeOf(vec2 place)`, which grows from a share of an ellipse's radius on; places are 0..1. */
const SHADE_GLSL = /* glsl */ `
uniform float vignetteStrength, vignetteStart;
float shadeOf(vec2 place) {
  vec2 away = (place - vec2(.5, .58)) / vec2(1.2, .9);
  return vignetteStrength * clamp((length(away) - vignetteStart) / (1. - vignetteStart), 0., 1.);
}
`;
/** GLSL for fragment shaders: `vec3 withVignette(vec3 colour)` of a displayed colour. */
export const VIGNETTE_GLSL = /* glsl */ `
${SHADE_GLSL}
uniform vec2 pictureSize; uniform vec3 vignetteColour;
vec3 withVignette(vec3 colour) { return mix(colour, vignetteColour, shadeOf(gl_FragCoord.xy / pictureSize)); }
`;
/**
 * The same from corner to corner of a grid: `setVignette()` in the vertex shader, after the position is set, sets the share
 * of the vignette's colour, `vShade`.
 */
export const VIGNETTE_VERTEX_GLSL = /* glsl */ `
${SHADE_GLSL}
varying float vShade;
void setVignette() { vShade = shadeOf(clamp(.5 * gl_Position.xy / max(gl_Position.w, 1e-3) + .5, -1., 2.)); }
`;
export function createVignetteUniforms(): VignetteUniforms {
  return {
    pictureSize: { value: new Vector2(1, 1) },
    vignetteColour: { value: new Color() },
    vignetteStrength: { value: 0 },
    vignetteStart: { value: 0 },
  };
}

export function applyLookToVignette(uniforms: VignetteUniforms, { vignette }: Look): void {
  // A displayed colour: it is mixed after the conversion from linear light.
  uniforms.vignetteColour.value.set(vignette.colour).convertLinearToSRGB();
  uniforms.vignetteStrength.value = vignette.strength;
  uniforms.vignetteStart.value = vignette.start;
}

/** Return a callback of objects that fits the vignette to the picture that is drawn, on whatever canvas. */
export function updateVignette({ pictureSize }: VignetteUniforms): Object3D["onBeforeRender"] {
  return (renderer) => (renderer as WebGLRenderer).getDrawingBufferSize(pictureSize.value);
}
