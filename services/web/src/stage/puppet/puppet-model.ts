/** The puppet as a mesh for export: its rest shape, and the swing of its sleeves. */
import { Matrix4, Quaternion, type SkinnedMesh, Texture, Vector3 } from "three";
import type { PuppetModel } from "../../export/glb";
import { type Figure, JOINTS } from "../../motion/skeleton";
import { encodePng } from "../rendering/canvas";
import { BONES } from "./bones";
import { createHeadModel } from "./face/head-model";
import { PATTERN } from "./finish";
import { FINGER_BONES, wristOf } from "./hand/finger-joints";
import { Puppet, setPuppetExtension } from "./puppet";
import { PuppetAssets } from "./puppet-assets";
import { PuppetExtension } from "./puppet-extension";
import { SIDES, SOLE_HEIGHT_M } from "./standard-figure";
import { createFaceTexture } from "./texture";

/** Minimum z of a triangle's normals for it to carry the face paint. */
const MIN_FACE_NORMAL_Z = 0.2;

/** First bone of the fingers: in files they belong to the wrists. */
const FIRST_FINGER = BONES.indexOf(FINGER_BONES[0]);

/** Create the model of a figure. Needs no graphics context. */
export function createPuppetModel(figure: Figure): PuppetModel {
  setPuppetExtension(PuppetExtension);
  // Files do not use the textures of the stage.
  const unpainted = { face: new Texture(), asanoha: new Texture() };
  const puppet = new Puppet(figure, new PuppetAssets(unpainted, { value: 0 }));
  const { geometry } = puppet.group.getObjectByName("figure") as SkinnedMesh;
  const values = (name: string) => geometry.getAttribute(name).array;
  const normals = Float32Array.from(values("normal")),
    pattern = values("pattern");
  const vertices = normals.length / 3;
  const ofHead = (vertex: number) => pattern[vertex * 3 + 2] === PATTERN.face;
  const painted = (vertex: number) => ofHead(vertex) && normals[vertex * 3 + 2] > MIN_FACE_NORMAL_Z;
  const face: number[] = [],
    body: number[] = [];
  const triangles = geometry.index?.array ?? [];
  for (let at = 0; at < triangles.length; at += 3) {
    const corners = [triangles[at], triangles[at + 1], triangles[at + 2]];
    (corners.every(painted) ? face : body).push(...corners);
  }
  const sleeves = SIDES.map(({ side }) => new SleeveRotation(puppet, side));
  const shape = {
    positions: Float32Array.from(values("position")),
    normals,
    colours: Float32Array.from(values("color")),
    faceUvs: Float32Array.from({ length: vertices * 2 }, (_, i) =>
      i % 2 === 0 ? pattern[(i / 2) * 3] : 1 - pattern[((i - 1) / 2) * 3 + 1],
    ),
  };
  return {
    ...shape,
    bones: Uint8Array.from(values("skinIndex"), (bone) =>
      bone < FIRST_FINGER ? bone : JOINTS.indexOf(wristOf(BONES[bone])),
    ),
    weights: Float32Array.from(values("skinWeight")),
    face: Uint32Array.from(face),
    body: Uint32Array.from(body),
    soleHeight: SOLE_HEIGHT_M * puppet.scale,
    separateHead() {
      const isHead = (_: number, at: number) => ofHead(body[at - (at % 3)]);
      const back = body.filter(isHead);
      const rest = Uint32Array.from(body.filter((corner, at) => !isHead(corner, at)));
      return { head: createHeadModel({ ...shape, face, back }), rest };
    },
    poseSleeves(pose, seconds, out) {
      puppet.apply(pose, seconds);
      sleeves.forEach((sleeve, at) => sleeve.write(out, at * 4));
    },
  };
}

/** Return the face texture as PNG. */
export async function renderFacePng(): Promise<Uint8Array<ArrayBuffer>> {
  const texture = createFaceTexture();
  const picture = await encodePng(texture.image);
  texture.dispose();
  if (!picture) throw new Error("The browser could not encode the puppet's face as PNG.");
  return new Uint8Array(await picture.arrayBuffer());
}

/**
 * Rotation of a sleeve. On the stage the bag shears against the arm, which no rotation does: this rotation keeps it
 * along the arm and hanging to the same side.
 */
class SleeveRotation {
  readonly #shoulder: Matrix4;
  readonly #sleeve: Matrix4;
  readonly #along: Vector3;
  readonly #rest: Quaternion;

  constructor(puppet: Puppet, side: string) {
    this.#shoulder = puppet.joint(`${side}_shoulder`);
    this.#sleeve = puppet.joint(`${side}_sleeve`);
    this.#along = new Vector3().fromArray(puppet.figure.offsets, JOINTS.indexOf(`${side}_elbow`) * 3).normalize();
    this.#rest = armFrame(this.#along.clone(), BAG_DIRECTION.clone()).invert();
  }

  /** Write the rotation in the shoulder's frame, for the puppet's current pose, as w x y z. */
  write(out: Float64Array, at: number): void {
    const hanging = armFrame(
      this.#along.clone().transformDirection(this.#sleeve),
      BAG_DIRECTION.clone().transformDirection(this.#sleeve),
    );
    const turn = new Quaternion().setFromRotationMatrix(this.#shoulder).invert().multiply(hanging).multiply(this.#rest);
    out.set([turn.w, turn.x, turn.y, turn.z], at);
  }
}

/** Direction in which the bag hangs at rest. */
const BAG_DIRECTION = new Vector3(0, 0, -1);

/** Return the rotation to axes along `arm`, and perpendicular to it towards `fall`. */
function armFrame(arm: Vector3, fall: Vector3): Quaternion {
  fall.addScaledVector(arm, -fall.dot(arm)).normalize();
  return new Quaternion().setFromRotationMatrix(new Matrix4().makeBasis(arm, fall, arm.clone().cross(fall)));
}
