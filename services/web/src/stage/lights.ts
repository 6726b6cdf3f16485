/** One shadow-casting key, a fill, two rims, and a studio for the lacquer and the hair to gleam with (section 4). */
import {
  Color, DirectionalLight, DoubleSide, Group, Mesh, MeshBasicMaterial, PlaneGeometry, PMREMGenerator, Scene, SpotLight, Vector3,
  type Texture, type WebGLRenderer,
} from "three";
import type { Look } from "./look";

export interface Lights {
  readonly group: Group;
  shadows: boolean;
  dress(look: Look): void;
}

export function createLights(): Lights {
  const spot = (angle: number, penumbra: number, from: [number, number, number], height: number) => {
    const light = new SpotLight("#fff", 1, 0, angle, penumbra, 2);
    light.position.set(...from);
    light.target.position.set(0, height, 0);
    return light;
  };
  const key = spot(0.36, 0.7, [-1.9, 3.9, 4.1], 0.9);
  key.castShadow = true;
  key.shadow.mapSize.set(1024, 1024);
  key.shadow.bias = -0.0006;
  key.shadow.normalBias = 0.012;
  key.shadow.radius = 5;
  key.shadow.camera.near = 2;
  key.shadow.camera.far = 9;
  const fill = new DirectionalLight("#fff", 1);
  fill.position.set(2.6, 1.5, 3.6);
  const warmRim = spot(0.5, 0.8, [2.6, 3, -2.3], 1.05);
  const coolRim = spot(0.5, 0.8, [-2.9, 1.6, -2], 1);
  const group = new Group();
  for (const light of [key, fill, warmRim, coolRim]) group.add(light, light.target);
  return {
    group,
    get shadows() {
      return key.castShadow;
    },
    set shadows(on) {
      key.castShadow = on;
    },
    dress(look) {
      for (const [light, [colour, intensity]] of [[key, look.key], [fill, look.fill], [warmRim, look.warmRim], [coolRim, look.coolRim]] as const) {
        light.color.set(colour);
        light.intensity = intensity;
      }
    },
  };
}

type Pane = readonly [colour: string, strength: number, width: number, height: number, at: readonly [number, number, number]];

const NIGHT: readonly Pane[] = [
  ["#ffe6c6", 7, 2.2, 3.4, [-4, 4.2, 3.5]],
  ["#ffd7a0", 2.2, 1.2, 5, [4.6, 2, -3]],
  ["#7d97e0", 2, 1.6, 5, [-4.8, 1.6, -2.6]],
  ["#ffffff", 1, 5, 1.2, [0, 6, 0]],
  ["#4b3a22", 1, 5, 5, [0, 1.4, -6]],
  ["#120f0d", 1, 14, 14, [0, -1.2, 0]],
];
const DAY: readonly Pane[] = [
  ["#fff6e8", 6, 3, 4, [-4, 4.2, 3.5]],
  ["#ffffff", 3, 4, 4, [0, 6, 0]],
  ["#dfe8ff", 2, 2, 5, [4.6, 2, 2]],
  ["#efe2cc", 1, 14, 14, [0, -1.2, 0]],
];

/** Prefiltered studio of light panes, built by code. The caller disposes of it. */
export function studio(renderer: WebGLRenderer, look: Look): Texture {
  const room = new Scene();
  room.background = new Color(look.dark ? "#07080d" : "#b9b0a2");
  for (const [colour, strength, width, height, at] of look.dark ? NIGHT : DAY) {
    const material = new MeshBasicMaterial({ color: new Color(colour).multiplyScalar(strength), side: DoubleSide });
    const pane = new Mesh(new PlaneGeometry(width, height), material);
    pane.position.set(...at);
    pane.lookAt(new Vector3(0, 1, 0));
    room.add(pane);
  }
  const generator = new PMREMGenerator(renderer);
  const { texture } = generator.fromScene(room, 0.035);
  generator.dispose();
  return texture;
}
