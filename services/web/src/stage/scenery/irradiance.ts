/** Light of the stage on a matt surface, for the floor in software rendering. */

/** GLSL for materials with lights: `vec3 irradiance(vec3 position, vec3 normal)`, both in the view's frame. */
export const IRRADIANCE_GLSL = /* glsl */ `
#include <lights_pars_begin>
vec3 irradiance(vec3 position, vec3 normal) {
  vec3 sum = vec3(0.);
  IncidentLight light;
  #if NUM_DIR_LIGHTS > 0
  for (int i = 0; i < NUM_DIR_LIGHTS; i++) {
    getDirectionalLightInfo(directionalLights[i], light);
    sum += max(dot(normal, light.direction), 0.) * light.color;
  }
  #endif
  #if NUM_SPOT_LIGHTS > 0
  for (int i = 0; i < NUM_SPOT_LIGHTS; i++) {
    getSpotLightInfo(spotLights[i], position, light);
    sum += max(dot(normal, light.direction), 0.) * light.color;
  }
  #endif
  return sum;
}
`;
