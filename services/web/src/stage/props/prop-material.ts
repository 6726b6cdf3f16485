/** Materials of the props: physical shading with the finish of each vertex, and a simple one for software rendering. */
import { type IUniform, MeshPhysicalMaterial, type Scene, ShaderMaterial, UniformsLib, UniformsUtils } from "three";
import { REFLECTED_LIGHT_GLSL } from "../scenery/reflected-light";

/** Create the material of all props; the attribute `finish` has roughness, metalness and clearcoat. */
export function createPropMaterial(): MeshPhysicalMaterial {
  const material = new MeshPhysicalMaterial({ vertexColors: true, clearcoat: 1, clearcoatRoughness: 0.16 });
  material.onBeforeCompile = (shader) => {
    shader.vertexShader = shader.vertexShader
      .replace("#include <common>", "#include <common>\nattribute vec3 finish; varying vec3 vFinish;")
      .replace("#include <begin_vertex>", "#include <begin_vertex>\nvFinish = finish;");
    shader.fragmentShader = shader.fragmentShader
      .replace("#include <common>", "#include <common>\nvarying vec3 vFinish;")
      .replace("#include <roughnessmap_fragment>", "float roughnessFactor = vFinish.x;")
      .replace("#include <metalnessmap_fragment>", "float metalnessFactor = vFinish.y;")
      .replace(
        "#include <lights_physical_fragment>",
        "#include <lights_physical_fragment>\nmaterial.clearcoat *= vFinish.z;",
      );
  };
  return material;
}

/** Light from everywhere, as a share of the intensity of the environment, and how much more metal reflects of it. */
const AMBIENT_SHARE = 0.5;
const METAL_GAIN = 1.2;

const SIMPLE_VERTEX_GLSL = /* glsl */ `
${REFLECTED_LIGHT_GLSL}
attribute vec3 finish; uniform float ambient;
varying vec3 vLight;
void main() {
  vec4 seen = modelViewMatrix * vec4(position, 1.);
  gl_Position = projectionMatrix * seen;
  float even = ambient * (1. + ${METAL_GAIN} * finish.y);
  vLight = reflectedLight(seen.xyz, normalize(normalMatrix * normal), color, even, finish.x);
}`;
const SIMPLE_FRAGMENT_GLSL = /* glsl */ `
varying vec3 vLight;
void main() {
  gl_FragColor = vec4(vLight, 1.);
  #include <tonemapping_fragment>
  #include <colorspace_fragment>
}`;

/** Material for machines without a graphics processor: light at the corners, without surroundings and shadows. */
export class SimplePropMaterial extends ShaderMaterial {
  readonly #ambient: IUniform<number> = { value: 0 };

  constructor() {
    super({
      lights: true,
      vertexColors: true,
      vertexShader: `#include <common>\n${SIMPLE_VERTEX_GLSL}`,
      fragmentShader: SIMPLE_FRAGMENT_GLSL,
    });
    this.uniforms = { ...UniformsUtils.clone(UniformsLib.lights), ambient: this.#ambient };
  }

  /** Take the surroundings of the scene that is drawn next. */
  prepare({ environmentIntensity }: Scene): void {
    this.#ambient.value = AMBIENT_SHARE * environmentIntensity;
    this.uniformsNeedUpdate = true;
  }
}
