/**
 * Backdrop: the disc of gold leaf on its ground, a plane behind the stage. The floor reflects the same GLSL function.
 */
import { Color, type IUniform, Mesh, PlaneGeometry, ShaderMaterial, Vector2 } from "three";
import type { Look } from "./look";
import { NOISE_GLSL } from "./noise";

/** Position of the plane, in metres along z from the centre of the stage. */
export const BACKDROP_Z_M = -2.6;

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
 * Create the plane, in the frame of the rig that follows the performers. In the day look it is not tone mapped: the
 * film curve would grey the paper.
 */
export function createBackdrop(uniforms: BackdropUniforms): Mesh {
  const material = new ShaderMaterial({
    uniforms,
    depthWrite: false,
    vertexShader: /* glsl */ `
      varying vec2 vAt;
      void main() {
        vAt = position.xy + vec2(0., 5.);
        gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.);
      }`,
    fragmentShader: /* glsl */ `
      ${BACKDROP_GLSL}
      varying vec2 vAt;
      void main() {
        gl_FragColor = vec4(backdrop(vAt, 0.), 1.);
        vec4 paper = gl_FragColor;
        #include <tonemapping_fragment>
        gl_FragColor = mix(paper, gl_FragColor, dark);
        #include <colorspace_fragment>
        gl_FragColor.rgb += (hash2(gl_FragCoord.xy) - .5) / 160.;
      }`,
  });
  const mesh = new Mesh(new PlaneGeometry(26, 14), material);
  mesh.name = "backdrop";
  mesh.position.set(0, 5, BACKDROP_Z_M);
  mesh.renderOrder = -5;
  return mesh;
}
