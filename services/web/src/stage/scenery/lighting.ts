/** One shadow-casting key, a fill and two rims (art direction, section 4); a show's own lights take their places. */
import { Color, DirectionalLight, Group, LinearSRGBColorSpace, MathUtils, SpotLight, Vector3 } from "three";
import type { LightState } from "../../playout/light-state";
import type { Look } from "./look";

/** Seconds in which a show's lights come on or go. */
const LIGHT_BLEND_S = 0.9;
/** What the fill and the studio keep of their light where the show is dark: the puppet is never lost from sight. */
const MIN_FILL_SHARE = 0.2;
/** Depth about the dancer that the key's shadows have, metres: towards the light and away. */
const SHADOW_DEPTH_M = [3.4, 3.6] as const;
/** No spot is wider, radians, and none nearer to the dancer, metres. */
const MAX_SPOT_ANGLE_RAD = 1.2;
const MIN_SPOT_DISTANCE_M = 0.8;

export interface Lights {
  readonly group: Group;
  castsShadows: boolean;
  /** How much light there is beside the spots, `DARKEST`..1 of the look's own. */
  readonly ambientLevel: number;
  applyLook(look: Look): void;
  /**
   * Moves on by `seconds`. The first of a show's `lights` stands for the key, the second for the warm rim, the third for the cool
   * one; full, each throws on the dancer what the look's own does, from its own place and in its own colour. The group's world
   * matrix is up to date. What is lit is `wide` times wider than one dancer's.
   */
  update(lights: readonly LightState[], seconds: number, widthScale?: number): void;
}

/** A spot as the look has it, and as it stands in for a light of the show. */
interface SpotRole {
  readonly light: SpotLight;
  readonly position: Vector3;
  readonly angle: number;
  readonly distance: number;
  readonly colour: Color;
  intensity: number;
  /** The show's: where, in which colour, and how much of full. */
  readonly motionLight: { place: Vector3; colour: Color; share: number };
  /** Of the way over to the show's, 0..1. */
  blendShare: number;
}

export function createLights(): Lights {
  const role = (angle: number, penumbra: number, from: [number, number, number], height: number): SpotRole => {
    const light = new SpotLight("#fff", 1, 0, angle, penumbra, 2);
    const place = new Vector3(...from);
    light.position.copy(place);
    light.target.position.set(0, height, 0);
    const distance = place.distanceTo(light.target.position);
    return {
      light,
      position: place,
      angle,
      distance,
      colour: new Color(),
      intensity: 1,
      motionLight: { place: place.clone(), colour: new Color(), share: 1 },
      blendShare: 0,
    };
  };
  const roles = [
    role(0.36, 0.7, [-1.9, 3.9, 4.1], 0.9),
    role(0.5, 0.8, [2.6, 3, -2.3], 1.05),
    role(0.5, 0.8, [-2.9, 1.6, -2], 1),
  ];
  const key = roles[0].light;
  key.castShadow = true;
  key.shadow.mapSize.set(1024, 1024);
  key.shadow.bias = -0.0006;
  key.shadow.normalBias = 0.012;
  key.shadow.radius = 5;
  const fill = new DirectionalLight("#fff", 1);
  fill.position.set(2.6, 1.5, 3.6);
  const group = new Group();
  for (const light of [key, fill, roles[1].light, roles[2].light]) group.add(light, light.target);
  let filled = 1;
  let level = 1;
  let wide = 1;
  const apply = () => {
    for (const one of roles) blendSpot(one, level, wide);
    fill.intensity = filled * level;
    const { camera } = key.shadow;
    const distance = key.position.distanceTo(key.target.position);
    camera.near = Math.max(distance - SHADOW_DEPTH_M[0] * wide, 0.2);
    camera.far = distance + SHADOW_DEPTH_M[1] * wide;
    camera.updateProjectionMatrix();
  };
  return {
    group,
    get castsShadows() {
      return key.castShadow;
    },
    set castsShadows(on) {
      key.castShadow = on;
    },
    get ambientLevel() {
      return level;
    },
    applyLook(look) {
      fill.color.set(look.fill[0]);
      filled = look.fill[1];
      [look.key, look.warmRim, look.coolRim].forEach(([colour, intensity], at) => {
        roles[at].colour.set(colour);
        roles[at].intensity = intensity;
      });
      apply();
    },
    update(lights, seconds, times = 1) {
      wide = times;
      roles.forEach((one, at) => {
        const told = lights[at];
        if (told) readLightState(told, one, group);
        const step = seconds / LIGHT_BLEND_S;
        one.blendShare = told ? Math.min(one.blendShare + step, 1) : Math.max(one.blendShare - step, 0);
      });
      const brightest = Math.max(
        ...roles.map(({ blendShare: over, motionLight: shown }) => (over > 0 ? shown.share : 0)),
      );
      const over = MathUtils.smoothstep(Math.max(...roles.map((one) => one.blendShare)), 0, 1);
      level = MathUtils.lerp(1, MathUtils.lerp(MIN_FILL_SHARE, 1, Math.min(brightest, 1)), over);
      apply();
    },
  };
}

/** Takes in what a light of the show is: its numbers are in the world's frame, a role's place is in the group's. */
function readLightState({ full, numbers }: LightState, { motionLight: shown, light }: SpotRole, group: Group): void {
  shown.place.set(numbers[0], numbers[1], numbers[2]);
  group.worldToLocal(shown.place);
  const away = shown.place.clone().sub(light.target.position);
  if (away.length() < MIN_SPOT_DISTANCE_M)
    shown.place
      .copy(light.target.position)
      .add(away.lengthSq() > 0 ? away.setLength(MIN_SPOT_DISTANCE_M) : away.set(0, MIN_SPOT_DISTANCE_M, 0));
  shown.colour.setRGB(numbers[3], numbers[4], numbers[5], LinearSRGBColorSpace);
  shown.share = numbers[6] / full;
}

/** Between the look's own light, of which `level` is left, from `wide` times further away, and the show's. From any distance as much light and as wide a cone reach the dancers. */
function blendSpot(
  { light, position: place, angle, distance, colour, intensity, motionLight: shown, blendShare: over }: SpotRole,
  level: number,
  widthScale: number,
): void {
  const share = MathUtils.smoothstep(over, 0, 1);
  light.position.copy(place).multiplyScalar(widthScale).lerp(shown.place, share);
  const nearer = distance / Math.max(light.position.distanceTo(light.target.position), MIN_SPOT_DISTANCE_M);
  light.color.lerpColors(colour, shown.colour, share);
  light.intensity = (intensity * MathUtils.lerp(level, shown.share, share)) / nearer ** 2;
  light.angle = Math.min(Math.atan(Math.tan(angle) * nearer * widthScale), MAX_SPOT_ANGLE_RAD);
}
