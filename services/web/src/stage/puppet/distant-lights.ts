/**
 * Lights of the stage as a performer gets them: each as strong, and from the direction, as at the performer's centre.
 * In software rendering, cones and distances for each pixel would take about half of the figure's time.
 */
import { type Camera, Color, DirectionalLight, type IUniform, MathUtils, type Scene, SpotLight, Vector3 } from "three";

/** Number of lights: a key, a fill and two rims. */
export const LIGHT_COUNT = 4;

export interface DistantLights {
  [name: string]: IUniform;
  /** Directions to the lights, in the view's frame. */
  lightDirections: IUniform<Vector3[]>;
  /** Light that a matt surface reflects if it faces the light. */
  lightColours: IUniform<Color[]>;
}

export function createDistantLights(): DistantLights {
  return {
    lightDirections: { value: Array.from({ length: LIGHT_COUNT }, () => new Vector3(0, 0, 1)) },
    lightColours: { value: Array.from({ length: LIGHT_COUNT }, () => new Color(0)) },
  };
}

const place = new Vector3();
const axis = new Vector3();

/** Set the lights of `scene` at the world position `at`. World matrices are up to date. */
export function updateDistantLights(
  { lightDirections, lightColours }: DistantLights,
  scene: Scene,
  camera: Camera,
  at: Vector3,
): void {
  let count = 0;
  scene.traverseVisible((light) => {
    if (count === LIGHT_COUNT || !(light instanceof SpotLight || light instanceof DirectionalLight)) return;
    const direction = lightDirections.value[count];
    const colour = lightColours.value[count].copy(light.color).multiplyScalar(light.intensity / Math.PI);
    count++;
    place.setFromMatrixPosition(light.matrixWorld);
    axis.setFromMatrixPosition(light.target.matrixWorld).sub(place).normalize();
    if (light instanceof SpotLight) {
      direction.copy(place).sub(at);
      const cosine = -axis.dot(direction) / direction.length();
      const [edge, core] = [Math.cos(light.angle), Math.cos(light.angle * (1 - light.penumbra))];
      colour.multiplyScalar(MathUtils.smoothstep(cosine, edge, core) / Math.max(direction.lengthSq(), 0.01));
    } else direction.copy(axis).negate();
    direction.normalize().transformDirection(camera.matrixWorldInverse);
  });
  for (; count < LIGHT_COUNT; count++) lightColours.value[count].set(0);
}
