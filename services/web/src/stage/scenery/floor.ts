/**
 * Stage floor. Night: black lacquer planks with an analytic mirror of the backdrop (the view ray is reflected, and the
 * backdrop is evaluated where it lands), so that no second render pass is needed. Day: pale wood that fades into the
 * ground.
 */
import {
  type IUniform,
  Matrix4,
  Mesh,
  MeshLambertMaterial,
  MeshStandardMaterial,
  type Object3D,
  PlaneGeometry,
  type Vector2,
} from "three";
import { BACKDROP_GLSL, BACKDROP_Z_M, type BackdropUniforms } from "./backdrop";
import type { Look } from "./look";

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

export interface Floor {
  readonly mesh: Mesh;
  applyLook(look: Look): void;
  dispose(): void;
}

/**
 * Create the floor. `rig` is the frame that it lies in, `offset` the distance that the rig has travelled, for the
 * boards, and `simple` leaves out the gloss for software rendering.
 */
export function createFloor(backdrop: BackdropUniforms, rig: Object3D, offset: Vector2, simple: boolean): Floor {
  const material = simple
    ? new MeshLambertMaterial({ transparent: true })
    : new MeshStandardMaterial({ transparent: true });
  const intoRig: IUniform<Matrix4> = { value: new Matrix4() };
  const opacityNear: IUniform<number> = { value: 1 };
  material.onBeforeCompile = (shader) => {
    Object.assign(shader.uniforms, backdrop, { travelled: { value: offset }, intoRig, opacityNear });
    shader.vertexShader = shader.vertexShader
      .replace("#include <common>", "#include <common>\nvarying vec3 vPlace;")
      .replace("#include <fog_vertex>", "#include <fog_vertex>\nvPlace = (modelMatrix * vec4(transformed, 1.)).xyz;");
    shader.fragmentShader = shader.fragmentShader
      .replace(
        "#include <common>",
        `#include <common>
varying vec3 vPlace; uniform vec2 travelled; uniform mat4 intoRig; uniform float opacityNear;
${BACKDROP_GLSL}`,
      )
      .replace("#include <opaque_fragment>", SHADE_GLSL)
      .replace("#include <tonemapping_fragment>", HORIZON_GLSL);
  };
  const mesh = new Mesh(new PlaneGeometry(26, 9), material);
  mesh.name = "floor";
  mesh.rotation.x = -Math.PI / 2;
  mesh.position.z = BACKDROP_Z_M + 4.5;
  mesh.receiveShadow = true;
  mesh.renderOrder = 2;
  mesh.onBeforeRender = () => intoRig.value.copy(rig.matrixWorld).invert();
  return {
    mesh,
    applyLook(look) {
      material.color.set(look.floor.colour);
      if (material instanceof MeshStandardMaterial) {
        material.roughness = look.floor.roughness;
        material.envMapIntensity = look.floor.environment;
      }
      opacityNear.value = look.floor.opacity;
    },
    dispose() {
      mesh.geometry.dispose();
      material.dispose();
    },
  };
}
