/** Environment map: a studio of light panes that lacquer and hair reflect. */
import {
  Color,
  DoubleSide,
  Mesh,
  MeshBasicMaterial,
  PlaneGeometry,
  PMREMGenerator,
  Scene,
  type Texture,
  Vector3,
  type WebGLRenderer,
} from "three";
import type { Look } from "./look";

/** Pane of light that faces the performer; colour as sRGB hex, sizes and position in metres. */
export type LightPane = readonly [
  colour: string,
  strength: number,
  width: number,
  height: number,
  at: readonly [number, number, number],
];

const NIGHT_PANES: readonly LightPane[] = [
  ["#ffe6c6", 7, 2.2, 3.4, [-4, 4.2, 3.5]],
  ["#ffd7a0", 2.2, 1.2, 5, [4.6, 2, -3]],
  ["#7d97e0", 2, 1.6, 5, [-4.8, 1.6, -2.6]],
  ["#ffffff", 1, 5, 1.2, [0, 6, 0]],
  ["#4b3a22", 1, 5, 5, [0, 1.4, -6]],
  ["#120f0d", 1, 14, 14, [0, -1.2, 0]],
];
const DAY_PANES: readonly LightPane[] = [
  ["#fff6e8", 6, 3, 4, [-4, 4.2, 3.5]],
  ["#ffffff", 3, 4, 4, [0, 6, 0]],
  ["#dfe8ff", 2, 2, 5, [4.6, 2, 2]],
  ["#efe2cc", 1, 14, 14, [0, -1.2, 0]],
];

export function studioPanes({ dark }: Look): readonly LightPane[] {
  return dark ? NIGHT_PANES : DAY_PANES;
}

export function studioBackground({ dark }: Look): string {
  return dark ? "#07080d" : "#b9b0a2";
}

/** Render the prefiltered environment map. The caller disposes of it. */
export function createEnvironmentMap(renderer: WebGLRenderer, look: Look): Texture {
  const studio = new Scene();
  studio.background = new Color(studioBackground(look));
  for (const [colour, strength, width, height, at] of studioPanes(look)) {
    const material = new MeshBasicMaterial({ color: new Color(colour).multiplyScalar(strength), side: DoubleSide });
    const pane = new Mesh(new PlaneGeometry(width, height), material);
    pane.position.set(...at);
    pane.lookAt(new Vector3(0, 1, 0));
    studio.add(pane);
  }
  const generator = new PMREMGenerator(renderer);
  const { texture } = generator.fromScene(studio, 0.035);
  generator.dispose();
  return texture;
}
