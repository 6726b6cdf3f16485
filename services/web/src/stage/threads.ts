/** The silk threads, four of each performer, in one draw: ribbons that face the camera, lit by how hard they are pulled (section 5). */
import {
  BufferAttribute, BufferGeometry, Color, CustomBlending, DoubleSide, Mesh, OneFactor, OneMinusSrcAlphaFactor, ShaderMaterial, Vector3,
} from "three";
import { MOST_LIMBS } from "../wire/limbs";

const THREADS = MOST_LIMBS;
const SEGMENTS = 40;
const CORNERS = 6;
const VERTICES = THREADS * (SEGMENTS + 1) * 2;

export interface Thread {
  colour: string;
  /** 0..1. */
  alpha: number;
  /** 0 slack .. 1 taut and lit. */
  tension: number;
  /** Metres the middle hangs through. */
  sag: number;
  /** The upper end dissolves (a free string). */
  fading: boolean;
}

export class Threads {
  readonly mesh: Mesh<BufferGeometry, ShaderMaterial>;
  readonly #attributes: Record<"position" | "tangent3" | "tint" | "pull", BufferAttribute>;
  readonly #colour = new Color();
  /** How each is dyed. */
  readonly #dyed: string[] = [];

  constructor() {
    const geometry = new BufferGeometry();
    const side = new Float32Array(VERTICES);
    const indices: number[] = [];
    for (let thread = 0; thread < THREADS; thread++) {
      for (let i = 0; i <= SEGMENTS; i++) {
        const a = (thread * (SEGMENTS + 1) + i) * 2;
        side[a] = -1;
        side[a + 1] = 1;
        if (i < SEGMENTS) indices.push(a, a + 1, a + 2, a + 1, a + 3, a + 2);
      }
    }
    const attribute = (size: number) => new BufferAttribute(new Float32Array(VERTICES * size), size);
    this.#attributes = { position: attribute(3), tangent3: attribute(3), tint: attribute(4), pull: attribute(1) };
    for (const [name, values] of Object.entries(this.#attributes)) geometry.setAttribute(name, values);
    geometry.setAttribute("side", new BufferAttribute(side, 1));
    geometry.setIndex(indices);
    const material = new ShaderMaterial({
      uniforms: { dark: { value: 1 } },
      transparent: true,
      depthWrite: false,
      side: DoubleSide,
      blending: CustomBlending,
      blendSrc: OneFactor,
      blendDst: OneMinusSrcAlphaFactor,
      vertexShader: /* glsl */ `
        attribute vec3 tangent3; attribute float side, pull; attribute vec4 tint;
        varying float vSide, vHalf, vPull; varying vec4 vTint;
        void main() {
          vec4 at = viewMatrix * vec4(position, 1.);
          vec2 along = (viewMatrix * vec4(tangent3, 0.)).xyz.xy;
          vHalf = pull > 0. ? .030 : .008; vSide = side; vPull = pull; vTint = tint;
          at.xy += normalize(vec2(-along.y, along.x) + 1e-6) * side * vHalf;
          gl_Position = projectionMatrix * at;
        }`,
      fragmentShader: /* glsl */ `
        uniform float dark;
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
          gl_FragColor = vec4(shown + gl_FragColor.rgb * glow, core);
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

  /** How many there are. */
  set count(count: number) {
    this.mesh.geometry.setDrawRange(0, count * SEGMENTS * CORNERS);
    for (const attribute of Object.values(this.#attributes)) {
      attribute.clearUpdateRanges();
      attribute.addUpdateRange(0, count * (SEGMENTS + 1) * 2 * attribute.itemSize);
    }
  }

  /** Draws thread `index` from a handle up to its other end, world metres. */
  set(index: number, from: Vector3, to: Vector3, thread: Thread): void {
    const { position, tangent3, pull } = this.#attributes;
    const { sag, tension } = thread;
    // numbers alone: every frame has some six hundred of these points
    const dx = to.x - from.x;
    const dy = to.y - from.y;
    const dz = to.z - from.z;
    const x = (t: number) => from.x + dx * t + sag * 0.6 * Math.sin(t * Math.PI);
    const y = (t: number) => from.y + dy * t - sag * 4 * t * (1 - t);
    for (let i = 0; i <= SEGMENTS; i++) {
      const t = i / SEGMENTS;
      const before = Math.max(0, t - 0.01);
      const after = Math.min(1, t + 0.01);
      for (let edge = 0; edge < 2; edge++) {
        const vertex = (index * (SEGMENTS + 1) + i) * 2 + edge;
        position.setXYZ(vertex, x(t), y(t), from.z + dz * t);
        tangent3.setXYZ(vertex, x(after) - x(before), y(after) - y(before), dz * (after - before));
        pull.setX(vertex, tension);
      }
    }
    position.needsUpdate = tangent3.needsUpdate = pull.needsUpdate = true;
    this.#dye(index, thread);
  }

  /** The colour of a thread, which changes seldom. */
  #dye(index: number, { colour, alpha, fading }: Thread): void {
    const dyed = `${colour} ${alpha} ${fading}`;
    if (dyed === this.#dyed[index]) return;
    this.#dyed[index] = dyed;
    const { r, g, b } = this.#colour.set(colour);
    const { tint } = this.#attributes;
    for (let i = 0; i <= SEGMENTS; i++) {
      const left = fading ? (1 - i / SEGMENTS) ** 1.3 : 1;
      for (let edge = 0; edge < 2; edge++) {
        const vertex = (index * (SEGMENTS + 1) + i) * 2 + edge;
        tint.setXYZW(vertex, r, g, b, alpha * left);
      }
    }
    tint.needsUpdate = true;
  }
}
