/**
 * Backdrop as textures of displayed colours, for software rendering: evaluating its noise for each pixel of each frame
 * takes longer than all else.
 */
import {
  LinearFilter,
  Mesh,
  OrthographicCamera,
  PlaneGeometry,
  Scene,
  ShaderMaterial,
  type WebGLRenderer,
  WebGLRenderTarget,
} from "three";
import { type BackdropUniforms, DISPLAYED_BACKDROP_GLSL } from "./backdrop";
import { BAKED_GLSL, type BakedUniforms } from "./baked-uniforms";

/** Sizes of the textures in pixels, and the blur of the second in metres: that of the floor's reflection. */
const SHARP_SIZE = [2048, 1024] as const;
const BLURRED_SIZE = [512, 256] as const;
const BLUR_M = 0.2;
const TARGET_OPTIONS = { depthBuffer: false, minFilter: LinearFilter, magFilter: LinearFilter };

export class BakedBackdrop {
  readonly #sharp = new WebGLRenderTarget(...SHARP_SIZE, TARGET_OPTIONS);
  readonly #blurred = new WebGLRenderTarget(...BLURRED_SIZE, TARGET_OPTIONS);
  readonly #scene = new Scene();
  readonly #camera = new OrthographicCamera(-1, 1, 1, -1, 0, 1);
  readonly #mesh: Mesh<PlaneGeometry, ShaderMaterial>;
  #isCurrent = false;

  /** Draw the backdrop of `uniforms` to the textures of `baked`. */
  constructor(uniforms: BackdropUniforms, baked: BakedUniforms) {
    const material = new ShaderMaterial({
      uniforms: { ...uniforms, blur: { value: 0 } },
      vertexShader: "varying vec2 vPlace; void main() { vPlace = uv; gl_Position = vec4(position.xy, 0., 1.); }",
      fragmentShader: /* glsl */ `
        ${DISPLAYED_BACKDROP_GLSL}
        ${BAKED_GLSL}
        varying vec2 vPlace;
        uniform float blur;
        void main() {
          gl_FragColor = vec4(displayedBackdrop(unbakedPlace(vPlace), blur) + (hash2(gl_FragCoord.xy) - .5) / 160., 1.);
        }`,
      depthTest: false,
      depthWrite: false,
      toneMapped: false,
    });
    this.#mesh = new Mesh(new PlaneGeometry(2, 2), material);
    this.#scene.add(this.#mesh);
    baked.bakedSharp.value = this.#sharp.texture;
    baked.bakedBlurred.value = this.#blurred.texture;
  }

  /** Draw the textures again at the next update: look or disc have changed. */
  invalidate(): void {
    this.#isCurrent = false;
  }

  /** Draw the textures, unless they are current. */
  update(renderer: WebGLRenderer): void {
    if (this.#isCurrent) return;
    this.#isCurrent = true;
    const previousTarget = renderer.getRenderTarget();
    for (const [target, blur] of [
      [this.#sharp, 0],
      [this.#blurred, BLUR_M],
    ] as const) {
      this.#mesh.material.uniforms.blur.value = blur;
      renderer.setRenderTarget(target);
      renderer.render(this.#scene, this.#camera);
    }
    renderer.setRenderTarget(previousTarget);
  }

  dispose(): void {
    this.#sharp.dispose();
    this.#blurred.dispose();
    this.#mesh.geometry.dispose();
    this.#mesh.material.dispose();
  }
}
