/**
 * Smoothing of edges in a part of the picture, where the context has no antialiasing of its own: without a graphics
 * processor, multisampling the whole picture takes two and a half times as long (`proto/NOTES.md`, "Page").
 *
 * After FXAA (T. Lottes, NVIDIA, 2009): where the luma of neighbours differs, mix colours along the edge. What a coarse
 * picture loses, it gets back by sharpening: elsewhere fully, and less where that would bring the stairs back.
 */
import {
  BufferAttribute,
  BufferGeometry,
  Camera,
  FramebufferTexture,
  type IUniform,
  LinearFilter,
  Mesh,
  ShaderMaterial,
  Vector2,
  type WebGLRenderer,
} from "three";
import { type ScreenBox, unionOf } from "../camera/screen-box";
import { bandsOf, insideBorder } from "./edge-bands";

const FRAGMENT_GLSL = /* glsl */ `
uniform sampler2D picture; uniform vec2 texel;
// Where the picture is transparent, edges are those of its alpha, too.
float luma(vec4 colour) { return dot(colour.rgb, vec3(.299, .587, .114)) + .5 * (1. - colour.a); }
void main() {
  vec2 at = gl_FragCoord.xy * texel;
  // Single texels: interpolated ones take several times as long without a graphics processor.
  ivec2 pixel = ivec2(gl_FragCoord.xy);
  vec4 leftUpColour = texelFetch(picture, pixel + ivec2(-1, 1), 0), rightUpColour = texelFetch(picture, pixel + 1, 0);
  vec4 leftDownColour = texelFetch(picture, pixel - 1, 0), rightDownColour = texelFetch(picture, pixel + ivec2(1, -1), 0);
  vec4 colour = texelFetch(picture, pixel, 0);
  float leftUp = luma(leftUpColour), rightUp = luma(rightUpColour);
  float leftDown = luma(leftDownColour), rightDown = luma(rightDownColour);
  float centre = luma(colour);
  float low = min(centre, min(min(leftUp, rightUp), min(leftDown, rightDown)));
  float high = max(centre, max(max(leftUp, rightUp), max(leftDown, rightDown)));
  vec3 lost = .5 * (colour - .25 * (leftUpColour + rightUpColour + leftDownColour + rightDownColour)).rgb;
  // Along the edge: across the gradient of the luma.
  vec2 along = vec2(leftDown + rightDown - leftUp - rightUp, leftUp + leftDown - rightUp - rightDown);
  float flatness = max((leftUp + rightUp + leftDown + rightDown) * .03, .008);
  along = clamp(along / (min(abs(along.x), abs(along.y)) + flatness), -8., 8.) * texel;
  vec4 near = .5 * (texture2D(picture, at - along / 6.) + texture2D(picture, at + along / 6.));
  vec4 far = .5 * near + .25 * (texture2D(picture, at - .5 * along) + texture2D(picture, at + .5 * along));
  float reached = luma(far);
  bool isEdge = high - low > max(.04, .125 * high);
  vec4 found = isEdge ? (reached < low || reached > high ? near : far) : colour;
  // Colours are premultiplied: none exceeds its alpha.
  gl_FragColor = vec4(clamp(found.rgb + (isEdge ? .4 : 1.) * lost, 0., found.a), found.a);
}`;

/** Distance to the pixels that a smoothed one is mixed of, in pixels. */
const REACH_PX = 8;
/** Bands in which the boxes of edges are smoothed. */
const MAX_BANDS = 12;

export class EdgeSmoothing {
  readonly #texel: IUniform<Vector2> = { value: new Vector2() };
  readonly #picture: IUniform<FramebufferTexture | null> = { value: null };
  readonly #material = new ShaderMaterial({
    uniforms: { texel: this.#texel, picture: this.#picture },
    vertexShader: "attribute vec2 corner; void main() { gl_Position = vec4(corner, 0., 1.); }",
    fragmentShader: FRAGMENT_GLSL,
    depthTest: false,
    depthWrite: false,
    toneMapped: false,
  });
  readonly #corners = new BufferAttribute(new Float32Array(MAX_BANDS * 12), 2);
  readonly #mesh = new Mesh(new BufferGeometry().setAttribute("corner", this.#corners), this.#material);
  readonly #camera = new Camera();

  constructor() {
    this.#mesh.frustumCulled = false;
  }

  /** Smooth what the canvas shows inside `boxes`, in shares of its width and height (0..1, y down). */
  apply(renderer: WebGLRenderer, boxes: readonly ScreenBox[]): void {
    const { width, height } = renderer.domElement;
    const smoothed = insideBorder(boxes, width, height);
    if (smoothed.length === 0) return;
    const { left, bottom, columns, rows } = clipTo(width, height, unionOf(smoothed), REACH_PX);
    const { properties, state } = renderer;
    const gl = renderer.getContext();
    const picture = this.#fitTexture(width, height);
    renderer.initTexture(picture);
    state.bindTexture(gl.TEXTURE_2D, (properties.get(picture) as { __webglTexture: WebGLTexture }).__webglTexture);
    gl.copyTexSubImage2D(gl.TEXTURE_2D, 0, left, bottom, left, bottom, columns, rows);
    this.#setBands(bandsOf(smoothed, MAX_BANDS));
    const { autoClear } = renderer;
    renderer.autoClear = false;
    renderer.render(this.#mesh, this.#camera);
    renderer.autoClear = autoClear;
  }

  dispose(): void {
    this.#picture.value?.dispose();
    this.#material.dispose();
    this.#mesh.geometry.dispose();
  }

  #setBands(bands: readonly ScreenBox[]): void {
    this.#mesh.geometry.setDrawRange(0, bands.length * 6);
    this.#corners.set(
      bands.flatMap(({ left, top, right, bottom }) => {
        const [x0, x1, y0, y1] = [2 * left - 1, 2 * right - 1, 1 - 2 * bottom, 1 - 2 * top];
        return [x0, y0, x1, y0, x1, y1, x0, y0, x1, y1, x0, y1];
      }),
    );
    this.#corners.needsUpdate = true;
  }

  /** Return the texture for a canvas of this size. */
  #fitTexture(width: number, height: number): FramebufferTexture {
    const { value } = this.#picture;
    if (value?.image.width === width && value.image.height === height) return value;
    value?.dispose();
    const texture = new FramebufferTexture(width, height);
    texture.minFilter = texture.magFilter = LinearFilter;
    this.#picture.value = texture;
    this.#texel.value.set(1 / width, 1 / height);
    return texture;
  }
}

/** Return the pixels inside `box`, and so many around it, of a canvas of this size; y up. */
function clipTo(width: number, height: number, box: ScreenBox, around: number) {
  const left = Math.max(0, Math.floor(box.left * width) - around);
  const bottom = Math.max(0, Math.floor((1 - box.bottom) * height) - around);
  const right = Math.min(width, Math.ceil(box.right * width) + around);
  const top = Math.min(height, Math.ceil((1 - box.top) * height) + around);
  return { left, bottom, columns: right - left, rows: top - bottom };
}
