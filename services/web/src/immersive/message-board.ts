/** Board in the room on which an immersive session shows short messages. */
import { CanvasTexture, Matrix4, Mesh, PlaneGeometry, ShaderMaterial, SRGBColorSpace, Vector3 } from "three";
import { createCanvas } from "../stage/rendering/canvas";

const WIDTH_PX = 1024;
const HEIGHT_PX = 128;
const MARGIN_PX = 40;
const WIDTH_M = 0.72;
/** Place in front of the viewer's eyes and above them, where it covers no performer, in metres. */
const DISTANCE_M = 1.1;
const RISE_M = 0.34;
/** Time for which a message is shown, in seconds. */
const DURATION_S = 5;
/** Longest step of that time: a frame that compiles shaders takes longer. */
const MAX_STEP_S = 0.1;

export class MessageBoard {
  readonly mesh: Mesh<PlaneGeometry, ShaderMaterial>;
  readonly #context: CanvasRenderingContext2D | null;
  readonly #texture: CanvasTexture;
  #remainingS = 0;

  constructor() {
    const canvas = createCanvas(WIDTH_PX, HEIGHT_PX) as HTMLCanvasElement;
    this.#context = canvas.getContext("2d");
    this.#texture = new CanvasTexture(canvas);
    this.#texture.colorSpace = SRGBColorSpace;
    const material = new ShaderMaterial({
      uniforms: { text: { value: this.#texture } },
      transparent: true,
      depthTest: false,
      depthWrite: false,
      toneMapped: false,
      vertexShader: /* glsl */ `
        varying vec2 vAt;
        void main() {
          vAt = uv;
          gl_Position = projectionMatrix * modelViewMatrix * vec4(position, 1.);
        }`,
      fragmentShader: /* glsl */ `
        uniform sampler2D text;
        varying vec2 vAt;
        void main() {
          gl_FragColor = texture2D(text, vAt);
          #include <colorspace_fragment>
        }`,
    });
    this.mesh = new Mesh(new PlaneGeometry(WIDTH_M, (WIDTH_M * HEIGHT_PX) / WIDTH_PX), material);
    this.mesh.visible = false;
    this.mesh.frustumCulled = false;
    this.mesh.renderOrder = 20;
  }

  /** Show a message in front of a viewer, whose pose in the room is `viewer`. */
  show(text: string, viewer: Matrix4): void {
    const eyes = new Vector3().setFromMatrixPosition(viewer);
    const ahead = new Vector3().setFromMatrixColumn(viewer, 2).negate().setY(0).normalize();
    this.mesh.position.copy(eyes).addScaledVector(ahead, DISTANCE_M);
    this.mesh.position.y += RISE_M;
    this.mesh.quaternion.setFromRotationMatrix(new Matrix4().lookAt(eyes, this.mesh.position, this.mesh.up));
    this.mesh.visible = true;
    this.#remainingS = DURATION_S;
    this.#write(text);
  }

  /** Advance by `seconds`. */
  update(seconds: number): void {
    this.#remainingS -= Math.min(seconds, MAX_STEP_S);
    this.mesh.visible = this.#remainingS > 0;
  }

  dispose(): void {
    this.#texture.dispose();
    this.mesh.geometry.dispose();
    this.mesh.material.dispose();
  }

  #write(text: string): void {
    const context = this.#context;
    if (!context) return;
    context.clearRect(0, 0, WIDTH_PX, HEIGHT_PX);
    context.fillStyle = "rgb(22 20 26 / 0.92)";
    context.beginPath();
    context.roundRect(0, 0, WIDTH_PX, HEIGHT_PX, HEIGHT_PX / 2);
    context.fill();
    context.fillStyle = "#f3ebdd";
    context.font = "500 40px system-ui, sans-serif";
    context.textAlign = "center";
    context.textBaseline = "middle";
    // A long message is set in narrower letters.
    context.fillText(text, WIDTH_PX / 2, HEIGHT_PX / 2, WIDTH_PX - 2 * MARGIN_PX);
    this.#texture.needsUpdate = true;
  }
}
