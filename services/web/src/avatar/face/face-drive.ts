/**
 * Face of an avatar: its expressions and eyes follow a performer's face. Where the face does not know the eyelids, they
 * follow the blinks of the stage.
 */
import { type VRM, VRMLookAtBoneApplier } from "@pixiv/three-vrm";
import { MathUtils, type Object3D } from "three";
import { EXPRESSIONS, expressionIndex, type Face, type FacePose, faceExpressionNames } from "../../motion/face";
import { EYE_PITCH_RAD, EYE_YAW_RAD, findGazeSource, type Gaze, type GazeSource, gazeFrom } from "../../motion/gaze";
import { ExpressionMapping } from "./expression-mapping";
import type { EyeBone } from "./eye-bones";
import { type FaceTarget, findMorphTargets, findVrmTargets } from "./face-target";

const EYELIDS = ["blink", "blinkLeft", "blinkRight", "eyeBlinkLeft", "eyeBlinkRight"];
const BLINK = expressionIndex("blink");
/** Blend shapes of the gaze: sideways and up or down, positive and negative, for each eye. */
const EYE_SHAPES = [
  { name: "eyeLookOutLeft", axis: "yaw", sign: 1 },
  { name: "eyeLookInLeft", axis: "yaw", sign: -1 },
  { name: "eyeLookInRight", axis: "yaw", sign: 1 },
  { name: "eyeLookOutRight", axis: "yaw", sign: -1 },
  ...["Left", "Right"].flatMap((side) => [
    { name: `eyeLookUp${side}`, axis: "pitch", sign: 1 } as const,
    { name: `eyeLookDown${side}`, axis: "pitch", sign: -1 } as const,
  ]),
] as const;

/** Parts of a model that show a face. */
export interface FaceModel {
  readonly root: Object3D;
  readonly vrm: Pick<VRM, "expressionManager" | "lookAt" | "humanoid"> | null;
  readonly eyes: readonly EyeBone[];
}

export class FaceDrive {
  readonly #targets: readonly FaceTarget[];
  readonly #names: readonly string[];
  readonly #weights: Float64Array;
  readonly #vrm: FaceModel["vrm"];
  readonly #eyes: readonly EyeBone[];
  readonly #blinkMapping: ExpressionMapping;
  readonly #blinkWeights = new Float64Array(EXPRESSIONS.length);
  #face: Face | null = null;
  #mapping: ExpressionMapping | null = null;
  #gazeSource: GazeSource | null = null;
  #ownsEyelids = true;
  readonly #gaze: Gaze = { yaw: 0, pitch: 0 };

  constructor({ root, vrm, eyes }: FaceModel) {
    this.#targets = vrm ? findVrmTargets(vrm) : findMorphTargets(root);
    this.#names = this.#targets.map(({ name }) => name);
    this.#weights = new Float64Array(this.#targets.length);
    this.#vrm = vrm;
    this.#eyes = eyes;
    this.#blinkMapping = new ExpressionMapping(["blink"], this.#names);
    this.#reset();
  }

  /** Show a face; null returns to the file's. `blink` (0..1) closes the eyes if the face does not know the eyelids. */
  apply(pose: FacePose | null, blink: number): void {
    const face = pose?.face ?? null;
    if (face !== this.#face) this.#setFace(face);
    if (pose && this.#mapping) {
      this.#mapping.apply(pose.weights, this.#weights);
      this.#showWeights(this.#mapping);
    }
    if (pose && this.#gazeSource) this.#look(gazeFrom(this.#gazeSource, pose.weights, this.#gaze));
    if (this.#ownsEyelids && this.#blinkMapping.written.length > 0) this.#blink(blink);
  }

  #setFace(face: Face | null): void {
    this.#reset();
    this.#face = face;
    const known = face ? faceExpressionNames(face) : [];
    this.#mapping = face && new ExpressionMapping(known, this.#names);
    this.#ownsEyelids = !known.some((name) => EYELIDS.includes(name));
    const source = face && findGazeSource(face);
    // The avatar's expressions of the same names turn the eyes then.
    const showsEyes = known.some((name) => name.startsWith("eyeLook") && this.#names.includes(name));
    this.#gazeSource = showsEyes ? null : source;
  }

  #showWeights({ written }: ExpressionMapping): void {
    for (const target of written) this.#targets[target].setWeight(this.#weights[target]);
  }

  #blink(weight: number): void {
    if (weight === this.#blinkWeights[BLINK]) return;
    this.#blinkWeights[BLINK] = weight;
    this.#blinkMapping.apply(this.#blinkWeights, this.#weights);
    this.#showWeights(this.#blinkMapping);
  }

  #look(gaze: Gaze): void {
    const lookAt = this.#vrm?.lookAt;
    if (lookAt && this.#turnsByVrm()) {
      lookAt.yaw = MathUtils.RAD2DEG * gaze.yaw;
      // VRM's pitch is positive downwards.
      lookAt.pitch = -MathUtils.RAD2DEG * gaze.pitch;
    } else if (this.#names.includes(EYE_SHAPES[0].name)) {
      for (const { name, axis, sign } of EYE_SHAPES) {
        const full = axis === "yaw" ? EYE_YAW_RAD : EYE_PITCH_RAD;
        this.#targets[this.#names.indexOf(name)]?.setWeight(Math.min(Math.max((sign * gaze[axis]) / full, 0), 1));
      }
    } else {
      for (const eye of this.#eyes) eye.turn(gaze);
    }
  }

  /** Return whether the gaze of the VRM file turns bones or sets expressions. */
  #turnsByVrm(): boolean {
    const { lookAt, humanoid } = this.#vrm ?? {};
    return !(lookAt?.applier instanceof VRMLookAtBoneApplier) || Boolean(humanoid?.getRawBoneNode("leftEye"));
  }

  #reset(): void {
    this.#blinkWeights[BLINK] = 0;
    this.#weights.fill(0);
    for (const target of this.#targets) target.reset();
    if (this.#vrm?.lookAt) this.#vrm.lookAt.yaw = this.#vrm.lookAt.pitch = 0;
    for (const eye of this.#eyes) eye.reset();
  }
}
