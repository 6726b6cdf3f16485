/** Stage lights: a shadow-casting key, a fill and two rims. The lights of a motion replace them. */
import { Color, DirectionalLight, Group, LinearSRGBColorSpace, MathUtils, SpotLight, Vector3 } from "three";
import type { LightState } from "../../playout/light-state";
import type { Look } from "./look";

/** Duration of the blend to and from a motion's lights, in seconds. */
const LIGHT_BLEND_S = 0.9;
/**
 * Share of the fill and the environment that remains when the motion's lights are dark: the puppet always stays
 * visible.
 */
const MIN_FILL_SHARE = 0.2;
/** Depth of the key's shadows around the performers, in metres: towards the light and away from it. */
const SHADOW_DEPTH_M = [3.4, 3.6] as const;
/** Limits of the motion's spots: largest angle in radians, and smallest distance from the performer in metres. */
const MAX_SPOT_ANGLE_RAD = 1.2;
const MIN_SPOT_DISTANCE_M = 0.8;

export interface Lights {
  readonly group: Group;
  castsShadows: boolean;
  /** Level of the light other than the spots, `MIN_FILL_SHARE`..1 of the look's own. */
  readonly ambientLevel: number;
  applyLook(look: Look): void;
  /**
   * Advance by `seconds`. The motion's first light replaces the key, the second the warm rim, the third the cool one.
   * At full intensity each gives the performer as much light as the look's own, from its own position and in its own
   * colour. The world matrix of the group must be up to date. The lit area is `widthScale` times as wide as for one
   * performer.
   */
  update(lights: readonly LightState[], seconds: number, widthScale?: number): void;
}

/** A spot of the look, and the motion's light that replaces it. */
interface SpotRole {
  readonly light: SpotLight;
  readonly position: Vector3;
  readonly angle: number;
  readonly distance: number;
  readonly colour: Color;
  intensity: number;
  /** The motion's light: position, colour and share of its full intensity. */
  readonly motionLight: { place: Vector3; colour: Color; share: number };
  /** Progress of the blend to the motion's light, 0..1. */
  blendShare: number;
}

export function createLights(): Lights {
  const createRole = (angle: number, penumbra: number, from: [number, number, number], height: number): SpotRole => {
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
    createRole(0.36, 0.7, [-1.9, 3.9, 4.1], 0.9),
    createRole(0.5, 0.8, [2.6, 3, -2.3], 1.05),
    createRole(0.5, 0.8, [-2.9, 1.6, -2], 1),
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
  let fillIntensity = 1;
  let level = 1;
  let currentWidth = 1;
  const apply = () => {
    for (const createRole of roles) blendSpot(createRole, level, currentWidth);
    fill.intensity = fillIntensity * level;
    const { camera } = key.shadow;
    const distance = key.position.distanceTo(key.target.position);
    camera.near = Math.max(distance - SHADOW_DEPTH_M[0] * currentWidth, 0.2);
    camera.far = distance + SHADOW_DEPTH_M[1] * currentWidth;
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
      fillIntensity = look.fill[1];
      [look.key, look.warmRim, look.coolRim].forEach(([colour, intensity], at) => {
        roles[at].colour.set(colour);
        roles[at].intensity = intensity;
      });
      apply();
    },
    update(lights, seconds, widthScale = 1) {
      currentWidth = widthScale;
      roles.forEach((createRole, at) => {
        const state = lights[at];
        if (state) readLightState(state, createRole, group);
        const step = seconds / LIGHT_BLEND_S;
        createRole.blendShare = state
          ? Math.min(createRole.blendShare + step, 1)
          : Math.max(createRole.blendShare - step, 0);
      });
      const brightest = Math.max(
        ...roles.map(({ blendShare, motionLight }) => (blendShare > 0 ? motionLight.share : 0)),
      );
      const blendShare = MathUtils.smoothstep(Math.max(...roles.map((createRole) => createRole.blendShare)), 0, 1);
      level = MathUtils.lerp(1, MathUtils.lerp(MIN_FILL_SHARE, 1, Math.min(brightest, 1)), blendShare);
      apply();
    },
  };
}

/** Read a motion's light: its numbers are in the world frame, a role's position is in the group's. */
function readLightState({ full, numbers }: LightState, { motionLight, light }: SpotRole, group: Group): void {
  motionLight.place.set(numbers[0], numbers[1], numbers[2]);
  group.worldToLocal(motionLight.place);
  const away = motionLight.place.clone().sub(light.target.position);
  if (away.length() < MIN_SPOT_DISTANCE_M)
    motionLight.place
      .copy(light.target.position)
      .add(away.lengthSq() > 0 ? away.setLength(MIN_SPOT_DISTANCE_M) : away.set(0, MIN_SPOT_DISTANCE_M, 0));
  motionLight.colour.setRGB(numbers[3], numbers[4], numbers[5], LinearSRGBColorSpace);
  motionLight.share = numbers[6] / full;
}

/**
 * Blend the look's own light, dimmed to `level` and moved `widthScale` times further away, with the motion's. At any
 * distance the same light and the same cone width reach the performers.
 */
function blendSpot(
  { light, position: place, angle, distance, colour, intensity, motionLight, blendShare }: SpotRole,
  level: number,
  widthScale: number,
): void {
  const share = MathUtils.smoothstep(blendShare, 0, 1);
  light.position.copy(place).multiplyScalar(widthScale).lerp(motionLight.place, share);
  const nearer = distance / Math.max(light.position.distanceTo(light.target.position), MIN_SPOT_DISTANCE_M);
  light.color.lerpColors(colour, motionLight.colour, share);
  light.intensity = (intensity * MathUtils.lerp(level, motionLight.share, share)) / nearer ** 2;
  light.angle = Math.min(Math.atan(Math.tan(angle) * nearer * widthScale), MAX_SPOT_ANGLE_RAD);
}
