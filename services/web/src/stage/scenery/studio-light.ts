/** Light of the studio in the environment map, approximated for software rendering, which has no map. */
import { Color, type IUniform, type Scene, Vector3, Vector4 } from "three";
import { studioBackground, studioPanes } from "./environment-map";
import type { Look } from "./look";

/** Panes of the studio with most panes. */
const PANE_COUNT = 6;

export interface StudioUniforms {
  [name: string]: IUniform;
  /** Direction to each pane, and the solid angle that it covers. */
  panes: IUniform<Vector4[]>;
  /** Radiance of each pane, and last that of the background. */
  paneColours: IUniform<Color[]>;
}

/**
 * GLSL: `vec3 studio(vec3 to, float lobe)`, the mean radiance of a lobe of this solid angle around a direction in the
 * world frame. Panes and lobes are spherical Gaussians.
 */
export const STUDIO_GLSL = /* glsl */ `
uniform vec4 panes[${PANE_COUNT}]; uniform vec3 paneColours[${PANE_COUNT + 1}];
vec3 studio(vec3 to, float lobe) {
  vec3 sum = paneColours[${PANE_COUNT}];
  for (int i = 0; i < ${PANE_COUNT}; i++) {
    float wide = panes[i].w + lobe;
    sum += paneColours[i] * panes[i].w / wide * exp(6.28 / wide * (dot(to, panes[i].xyz) - 1.));
  }
  return sum;
}
`;

export function createStudioUniforms(): StudioUniforms {
  return {
    panes: { value: Array.from({ length: PANE_COUNT }, () => new Vector4()) },
    paneColours: { value: Array.from({ length: PANE_COUNT + 1 }, () => new Color(0)) },
  };
}

/** Set the studio of a look, as bright as the environment of `scene`. */
export function updateStudio(
  { panes, paneColours }: StudioUniforms,
  look: Look,
  { environmentIntensity }: Scene,
): void {
  const to = new Vector3();
  const shown = studioPanes(look);
  panes.value.forEach((pane, at) => {
    const [colour, strength, width, height, place] = shown[at] ?? ["#000", 0, 0, 0, [0, 1, 0]];
    const area = width * height;
    to.set(...place);
    // At most half a sphere.
    const angle = area / (to.lengthSq() + area / (2 * Math.PI));
    to.normalize();
    pane.set(to.x, to.y, to.z, angle);
    paneColours.value[at].set(colour).multiplyScalar(strength * environmentIntensity);
  });
  paneColours.value[PANE_COUNT].set(studioBackground(look)).multiplyScalar(environmentIntensity);
}
