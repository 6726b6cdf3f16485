/**
 * The puppet's material for software rendering: colours, patterns and wood, with light from a table and bones as
 * uniforms, since each read of a bone texture takes time at every corner.
 */
import { type Camera, type IUniform, ShaderMaterial, type Skeleton, type Texture, Vector4 } from "three";
import { BONES, FACE_BONE } from "./bones";
import type { MaterialPart } from "./finish";
import { LIGHT_PLACE_GLSL } from "./light-table";
import { COLOUR_GLSL, FRAGMENT_HEADER_GLSL, type PuppetTextures, WOOD_SEED_GLSL } from "./material";

/** Rows of a bone's matrix; the fourth is that of any affine one. */
const ROWS = 3;

const VERTEX_GLSL = /* glsl */ `
attribute vec4 finish; attribute vec3 pattern;
${LIGHT_PLACE_GLSL}
uniform vec4 bones[${ROWS * BONES.length}];
// Few: each takes time at every triangle. The last of vSolid is that of the normal on the face, or else the wood.
varying vec4 vSolid; varying vec3 vPattern, vColour; varying vec2 vLight;
mat3x4 rows(float bone) {
  int at = ${ROWS} * int(bone);
  return mat3x4(bones[at], bones[at + 1], bones[at + 2]);
}
void main() {
  mat3x4 skin = rows(skinIndex.x);
  if (skinWeight.x < 1.) {
    skin = skin * skinWeight.x + rows(skinIndex.y) * skinWeight.y;
    if (skinWeight.z > 0.) skin += rows(skinIndex.z) * skinWeight.z + rows(skinIndex.w) * skinWeight.w;
  }
  vPattern = pattern;
  vSolid = vec4(position + skinIndex.x * ${WOOD_SEED_GLSL}, pattern.z > .5 ? normal.z : finish.w);
  gl_Position = projectionMatrix * vec4(vec4(position, 1.) * skin, 1.);
  vColour = color;
  vLight = lightPlace(normalize(vec4(normal, 0.) * skin), finish.x);
}`;
const FRAGMENT_GLSL = /* glsl */ `
${FRAGMENT_HEADER_GLSL}
uniform sampler2D lightTable;
varying vec3 vColour; varying vec2 vLight;
void main() {
  vec4 diffuseColor = vec4(vColour, 1.);
  ${COLOUR_GLSL}
  vec3 light = texture2D(lightTable, vLight).rgb, gloss = texture2D(lightTable, vLight + vec2(0., .5)).rgb;
  gl_FragColor = vec4(diffuseColor.rgb * light + gloss, 1.);
  #include <tonemapping_fragment>
  // The transfer function of sRGB within 1 %, without powers, which take a tenth of the figure's time.
  vec3 root = sqrt(gl_FragColor.rgb);
  gl_FragColor.rgb = 1.4214 * root - .1349 * sqrt(root) - .2954 * gl_FragColor.rgb;
}`;

export class SimpleFigureMaterial extends ShaderMaterial {
  readonly #bones: IUniform<Float32Array> = { value: new Float32Array(4 * ROWS * BONES.length) };
  readonly #movements: IUniform<Vector4[]> = { value: Array.from({ length: 4 }, () => new Vector4()) };
  readonly #lightTable: IUniform<Texture | null> = { value: null };

  constructor(textures: PuppetTextures, part: MaterialPart) {
    super({
      defines: { PLAIN: "", ...(part === "faceless" && { FACELESS: "" }) },
      vertexColors: true,
      vertexShader: VERTEX_GLSL,
      fragmentShader: FRAGMENT_GLSL,
    });
    this.uniforms = {
      bones: this.#bones,
      movements: this.#movements,
      lightTable: this.#lightTable,
      facePaint: { value: textures.face },
      hempLeaf: { value: textures.asanoha },
    };
  }

  /** Take the pose and the light of the figure that is drawn next. */
  prepare({ boneMatrices }: Skeleton, lightTable: Texture, camera: Camera): void {
    this.#lightTable.value = lightTable;
    const { elements: view } = camera.matrixWorldInverse;
    const matrices = boneMatrices as Float32Array;
    this.#movements.value.forEach((column, at) => column.fromArray(matrices, 16 * BONES.indexOf(FACE_BONE) + 4 * at));
    const { value: rows } = this.#bones;
    for (let bone = 0; bone < BONES.length; bone++)
      for (let row = 0; row < ROWS; row++)
        for (let column = 0; column < 4; column++) {
          let sum = column === 3 ? view[12 + row] : 0;
          for (let k = 0; k < 3; k++) sum += view[4 * k + row] * matrices[16 * bone + 4 * column + k];
          rows[4 * (ROWS * bone + row) + column] = sum;
        }
    this.uniformsNeedUpdate = true;
  }
}
