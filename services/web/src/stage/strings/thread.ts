/** The silk threads, four per performer, in one draw call: ribbons that face the camera, lit by their tension. */
import {
  Color,
  CustomBlending,
  DoubleSide,
  InstancedBufferAttribute,
  InstancedBufferGeometry,
  Mesh,
  OneFactor,
  OneMinusSrcAlphaFactor,
  PlaneGeometry,
  ShaderMaterial,
  type Vector3,
} from "three";
import { MAX_LIMBS } from "../../wire/limbs";

const SEGMENTS = 40;

export interface Thread {
  colour: string;
  /** 0..1. */
  alpha: number;
  /** 0 slack .. 1 taut and lit. */
  tension: number;
  /** Sag of the middle, in metres. */
  sag: number;
  /** True if the upper end fades out (a free string). */
  fadesOut: boolean;
}

export class Threads {
  readonly mesh: Mesh<InstancedBufferGeometry, ShaderMaterial>;
  readonly #attributes: Record<"foot" | "top" | "tint" | "shape", InstancedBufferAttribute>;
  readonly #colour = new Color();

  /** Draws at most `capacity` threads. */
  constructor(capacity = MAX_LIMBS) {
    const ribbon = new PlaneGeometry(2, 1, 1, SEGMENTS);
    const geometry = new InstancedBufferGeometry();
    geometry.index = ribbon.index;
    geometry.setAttribute("position", ribbon.getAttribute("position"));
    const attribute = (size: number) => new InstancedBufferAttribute(new Float32Array(capacity * size), size);
    this.#attributes = { foot: attribute(3), top: attribute(3), tint: attribute(4), shape: attribute(3) };
    for (const [name, values] of Object.entries(this.#attributes)) geometry.setAttribute(name, values);
    geometry.instanceCount = 0;
    const material = new ShaderMaterial({
      uniforms: { dark: { value: 1 }, overNothing: { value: 0 } },
      transparent: true,
      depthWrite: false,
      side: DoubleSide,
      blending: CustomBlending,
      blendSrc: OneFactor,
      blendDst: OneMinusSrcAlphaFactor,
      vertexShader: /* glsl */ `
        attribute vec3 foot, top, shape; attribute vec4 tint;
        varying float vSide, vHalf, vPull; varying vec4 vTint;
        vec3 on(float t) {
          return mix(foot, top, t) + shape.y * vec3(.6 * sin(t * 3.14159265), -4. * t * (1. - t), 0.);
        }
        void main() {
          float t = position.y + .5;
          vec4 at = viewMatrix * vec4(on(t), 1.);
          vec2 along = (viewMatrix * vec4(on(min(t + .01, 1.)) - on(max(t - .01, 0.)), 0.)).xy;
          vSide = position.x; vPull = shape.x; vTint = tint;
          vHalf = vPull > 0. ? .030 : .008;
          if (shape.z > 0.) vTint.a *= pow(1. - t, 1.3);
          at.xy += normalize(vec2(-along.y, along.x) + 1e-6) * vSide * vHalf;
          gl_Position = projectionMatrix * at;
        }`,
      fragmentShader: /* glsl */ `
        uniform float dark, overNothing;
        varying float vSide, vHalf, vPull; varying vec4 vTint;
        void main() {
          float away = abs(vSide) * vHalf, pixel = fwidth(vSide) * vHalf;
          float width = max(.0011 + .0006 * vPull, .75 * pixel);
          float core = (1. - smoothstep(width - .5 * pixel, width + .5 * pixel, away)) * vTint.a;
          float edge = 1. - smoothstep(.55, 1., abs(vSide));
          float glow = (.26 * exp(-away * away / 2.7e-5) + .066 * exp(-away / .011)) * vPull * edge * vTint.a * dark;
          vec3 lit = mix(vTint.rgb, vec3(1., .98, .94), .42 * vPull * dark);
          gl_FragColor = vec4(lit, 1.);
          #include <colorspace_fragment>
          vec3 shown = gl_FragColor.rgb * core;
          gl_FragColor = vec4(vTint.rgb, 1.);
          #include <colorspace_fragment>
          shown += gl_FragColor.rgb * glow;
          // The glow is added to what is behind. Where there is nothing, no colour may be stronger than its alpha.
          gl_FragColor = vec4(shown, max(core, overNothing * max(shown.r, max(shown.g, shown.b))));
        }`,
    });
    this.mesh = new Mesh(geometry, material);
    this.mesh.name = "threads";
    this.mesh.frustumCulled = false;
    this.mesh.renderOrder = 6;
  }

  set dark(on: boolean) {
    this.mesh.material.uniforms.dark.value = on ? 1 : 0;
  }

  /** Draws for a transparent picture, whose colours are multiplied by its alpha. */
  set isOverNothing(on: boolean) {
    this.mesh.material.uniforms.overNothing.value = on ? 1 : 0;
  }

  set count(count: number) {
    this.mesh.geometry.instanceCount = count;
  }

  /** Draw thread `index` from a handle to its other end, in world metres. */
  set(index: number, from: Vector3, to: Vector3, { colour, alpha, tension, sag, fadesOut: fading }: Thread): void {
    const { foot, top, tint, shape } = this.#attributes;
    const { r, g, b } = this.#colour.set(colour);
    foot.setXYZ(index, from.x, from.y, from.z);
    top.setXYZ(index, to.x, to.y, to.z);
    tint.setXYZW(index, r, g, b, alpha);
    shape.setXYZ(index, tension, sag, fading ? 1 : 0);
    for (const attribute of [foot, top, tint, shape]) attribute.needsUpdate = true;
  }
}
