/** Rings around the limbs' handles, four per performer: one instanced billboard, drawn over everything. */
import {
  Color,
  InstancedBufferAttribute,
  InstancedBufferGeometry,
  Mesh,
  PlaneGeometry,
  ShaderMaterial,
  type Vector3,
} from "three";
import { MAX_LIMBS } from "../../wire/limbs";

const MAX_RINGS = MAX_LIMBS;

export interface HandleRing {
  colour: string;
  alpha: number;
  /** Radius in metres, and the stroke width as a share of it. */
  radius: number;
  lineShare: number;
  glow: number;
}

export class HandleRings {
  readonly mesh: Mesh<InstancedBufferGeometry, ShaderMaterial>;
  readonly #place = new InstancedBufferAttribute(new Float32Array(MAX_RINGS * 3), 3);
  readonly #tint = new InstancedBufferAttribute(new Float32Array(MAX_RINGS * 4), 4);
  readonly #shape = new InstancedBufferAttribute(new Float32Array(MAX_RINGS * 3), 3);
  readonly #colour = new Color();

  constructor() {
    const square = new PlaneGeometry(2, 2);
    const geometry = new InstancedBufferGeometry();
    geometry.index = square.index;
    geometry.setAttribute("position", square.getAttribute("position"));
    geometry.setAttribute("place", this.#place);
    geometry.setAttribute("tint", this.#tint);
    geometry.setAttribute("shape", this.#shape);
    geometry.instanceCount = 0;
    const material = new ShaderMaterial({
      transparent: true,
      depthWrite: false,
      depthTest: false,
      vertexShader: /* glsl */ `
        attribute vec3 place, shape; attribute vec4 tint;
        varying vec2 vAt; varying vec4 vTint; varying vec3 vShape;
        void main() {
          vAt = position.xy * 1.6; vTint = tint; vShape = shape;
          vec4 at = viewMatrix * vec4(place, 1.);
          at.xy += vAt * shape.x;
          gl_Position = projectionMatrix * at;
        }`,
      fragmentShader: /* glsl */ `
        varying vec2 vAt; varying vec4 vTint; varying vec3 vShape;
        void main() {
          float r = length(vAt), soft = .9 * fwidth(r) + .004;
          float line = 1. - smoothstep(vShape.y, vShape.y + soft, abs(r - .92));
          float dot = 1. - smoothstep(.085, .085 + soft, r);
          float glow = exp(-pow((r - .92) / .22, 2.)) * vShape.z;
          float fill = .06 * (1. - smoothstep(.86, .92, r));
          gl_FragColor = vec4(vTint.rgb, clamp(max(line, .9 * dot) + .3 * glow + fill, 0., 1.) * vTint.a);
          #include <colorspace_fragment>
        }`,
    });
    this.mesh = new Mesh(geometry, material);
    this.mesh.name = "rings";
    this.mesh.frustumCulled = false;
    this.mesh.renderOrder = 8;
  }

  set count(count: number) {
    this.mesh.geometry.instanceCount = count;
  }

  set(index: number, position: Vector3, ring: HandleRing): void {
    const { r, g, b } = this.#colour.set(ring.colour);
    this.#place.setXYZ(index, position.x, position.y, position.z);
    this.#tint.setXYZW(index, r, g, b, ring.alpha);
    this.#shape.setXYZ(index, ring.radius, ring.lineShare, ring.glow);
    for (const attribute of [this.#place, this.#tint, this.#shape]) attribute.needsUpdate = true;
  }
}
