/**
 * Painting of the face as a shader: the texture, of which brows, lids and lips are moved, and eyes that are painted
 * anew. Positions are those of `texture.ts`, in metres from the centre of the face.
 */
import { BONES, FACE_BONE } from "../bones";

/**
 * Function that returns the paint, which multiplies the colour of the gofun, for a position on the texture. The
 * expression is in the matrix of the face's bone (`MOVEMENTS` in expression.ts): eyes, brows, and mouth in columns of
 * four; with `PLAIN`, a uniform has these columns. At 0 the texture is not changed.
 */
export const FACE_PAINT_GLSL = /* glsl */ `
#ifdef PLAIN
uniform vec4 movements[4];
#define MOVEMENTS(column) movements[column]
#else
uniform highp sampler2D boneTexture;
#define MOVEMENTS(column) texelFetch(boneTexture, texel + ivec2(column, 0), 0)
#endif
vec3 paintFace(vec2 uv) {
#ifndef PLAIN
  int at = ${4 * BONES.indexOf(FACE_BONE)}, size = textureSize(boneTexture, 0).x;
  ivec2 texel = ivec2(at % size, at / size);
#endif
  vec2 window = vec2(.2, .26), p = (uv - .5) * window, dx = dFdx(uv), dy = dFdy(uv);
  bool isLeft = p.x > 0.;
  vec4 eye = MOVEMENTS(isLeft ? 0 : 1), brows = MOVEMENTS(2), mouth = MOVEMENTS(3);
  float x = abs(p.x), y = p.y, pixel = length(vec2(dx.y, dy.y)) * window.y;
  vec4 drawn = vec4(0.);
  if (eye != vec4(0.)) {
    // Lines of both lids over the eye's width, t, with half the width of the brush.
    float t = clamp((x - .012) / (.032 + .135 * (x - .012)), 0., 1.), bow = 4. * t * (1. - t);
    float raise = .0035 * bow * eye.y;
    float drop = (eye.x < 0. ? .0024 * eye.x : .0126 * eye.x) * bow - raise * max(eye.x, 0.);
    float upper = .0012 + t * (.034 - .0282 * t) - drop, lower = .0033 + t * (.0307 * t - .026) + raise;
    float brush = .0009 + t * (.0044 - .0047 * t);
    float open = clamp((upper - .6 * brush - y) / pixel + .5, 0., 1.) * clamp((y - lower - .0004) / pixel + .5, 0., 1.);
    vec2 iris = p - vec2(isLeft ? .0283 : -.0283, .006) - eye.zw * vec2(.0068, .003), light = iris - vec2(.0015, .0018);
    float ink = clamp((1. - length(iris / vec2(.00625, .0081))) * .007 / pixel + .5, 0., 1.);
    float shine = .9 * clamp((1. - length(light / vec2(.001, .0013))) * .0011 / pixel + .5, 0., 1.);
    drawn = vec4(mix(mix(vec3(.965, .93, .855), vec3(.0086, .0056, .0048), ink), vec3(1., .95, .87), shine),
      open * step(.013, x) * step(x, .0465));
    if (p.y > upper - brush) y += drop * clamp((.027 - p.y) / (.025 - upper), 0., 1.);
    else if (p.y < lower) y -= raise * clamp((p.y + .025) / (lower + .024), 0., 1.);
  }
  float side = clamp((x - .012) / .042, 0., 1.);
  y -= .0055 * (isLeft ? mix(brows.x, brows.y, side) : mix(brows.z, brows.w, side)) *
    smoothstep(.014, .026, p.y) * smoothstep(.085, .055, p.y);
  float lips = smoothstep(.045, .02, x) * smoothstep(.024, .012, abs(p.y + .059));
  p.x /= 1. + mouth.y * (mouth.y < 0. ? .36 : .28) * lips;
  float corner = min(abs(p.x) / .0165, 1.3);
  y -= .0042 * corner * corner * lips * (isLeft ? mouth.z : mouth.w);
  y += (y + .059) * .3 * min(mouth.y, 0.) * lips;
  float gap = .0098 * mouth.x * sqrt(max(1. - corner * corner * 1.13, 0.));
  float depth = .001 * corner * corner - .059 - y;
  if (mouth.x > 0. && depth > 0. && lips > 0.) {
    drawn = vec4(.06, .009, .007, clamp(depth / pixel, 0., 1.) * clamp((gap - depth) / pixel, 0., 1.));
    if (depth > .5 * gap) y += gap * clamp((p.y + .105) / (.046 - gap), 0., 1.);
  }
  return mix(textureGrad(facePaint, vec2(p.x, y) / window + .5, dx, dy).rgb, drawn.rgb, drawn.a);
}
`;
