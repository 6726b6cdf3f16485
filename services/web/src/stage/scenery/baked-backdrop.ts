/**
 * Backdrop as textures of displayed colours, for software rendering: its noise is evaluated once, not for each pixel of
 * each frame.
 */
import { LinearFilter, ShaderMaterial, type WebGLRenderer, WebGLRenderTarget } from "three";
import { FullScreenQuad } from "three/examples/jsm/postprocessing/Pass.js";
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
  readonly #material: ShaderMaterial;
  readonly #quad: FullScreenQuad;
  #isCurrent = false;

  /** Draw the backdrop of `uniforms` to the textures of `baked`. */
  constructor(uniforms: BackdropUniforms, baked: BakedUniforms) {
    this.#material = new ShaderMaterial({
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
    this.#quad = new FullScreenQuad(this.#material);
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
      this.#material.uniforms.blur.value = blur;
      renderer.setRenderTarget(target);
      this.#quad.render(renderer);
    }
    renderer.setRenderTarget(previousTarget);
  }

  dispose(): void {
    this.#sharp.dispose();
    this.#blurred.dispose();
    this.#material.dispose();
  }
}
