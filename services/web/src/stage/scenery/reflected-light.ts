/** Light that surfaces of the stage reflect, for software rendering. */

/**
 * GLSL: `float glint(float a, float nl, float nv, float nh)`, pi times the specular reflection of a light for the
 * cosines between normal, light, view and the half vector: distribution of GGX and visibility of Smith, after three.js's
 * physical shading. `a` is the roughness to the power of four.
 */
export const GLINT_GLSL = /* glsl */ `
float glint(float a, float nl, float nv, float nh) {
  float d = nh * nh * (a - 1.) + 1.;
  return .5 * nl * a / (d * d * (nl * sqrt(a + (1. - a) * nv * nv) + nv * sqrt(a + (1. - a) * nl * nl) + 1e-4));
}
`;

/**
 * GLSL for vertex shaders of materials with lights: `vec3 reflectedLight(...)` of a dielectric with this roughness at a
 * position and normal in the view's frame. `ambient` is light from everywhere.
 */
export const REFLECTED_LIGHT_GLSL = /* glsl */ `
#include <lights_pars_begin>
${GLINT_GLSL}
vec3 reflectOne(IncidentLight light, vec3 view, vec3 normal, vec3 colour, float rough) {
  vec3 between = normalize(light.direction + view);
  float nl = max(dot(normal, light.direction), 0.), nv = max(dot(normal, view), .01), nh = dot(normal, between);
  float fresnel = .04 + .96 * pow(1. - dot(view, between), 5.);
  return RECIPROCAL_PI * light.color * mix(nl * colour, vec3(glint(pow(rough, 4.), nl, nv, nh)), fresnel);
}
vec3 reflectedLight(vec3 position, vec3 normal, vec3 colour, float ambient, float rough) {
  vec3 view = normalize(-position), sum = colour * ambient;
  IncidentLight light;
  #if NUM_DIR_LIGHTS > 0
  for (int i = 0; i < NUM_DIR_LIGHTS; i++) {
    getDirectionalLightInfo(directionalLights[i], light);
    sum += reflectOne(light, view, normal, colour, rough);
  }
  #endif
  #if NUM_SPOT_LIGHTS > 0
  for (int i = 0; i < NUM_SPOT_LIGHTS; i++) {
    getSpotLightInfo(spotLights[i], position, light);
    sum += reflectOne(light, view, normal, colour, rough);
  }
  #endif
  return sum;
}
`;
