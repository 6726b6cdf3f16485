/**
 * A user's own figure in the puppet's place. Its limbs point in the same directions as the streamed figure's, whatever
 * pose its file rests in: the rest direction of each bone is aligned with the figure's, and streamed rotations are
 * converted to the file's axes. Its size follows the lengths of trunk and limbs; its path over the floor is scaled by
 * the ratio of the hips' heights, and its lowest foot is at the height of the figure's. Planted feet are then kept in
 * place (`PlantedFeet`).
 */
import { Group, Matrix4, type Object3D, Quaternion, Vector3 } from "three";
import type { StagedPose } from "../motion/extension";
import { BONES, T_POSE_TO_REST, tPoseFigure } from "../motion/humanoid";
import { createWorldTransforms, type Figure, JOINTS, TIP_JOINTS, worldTransforms } from "../motion/skeleton";
import { figureScale, restPositions, totalLimbLength } from "../stage/puppet/figure-fit";
import { floorHeight, handlePosition, type Performer } from "../stage/puppet/performer";
import { PlantedFeet } from "../stage/puppet/planted-feet";
import { SOLE_HEIGHT_M } from "../stage/puppet/standard-figure";
import { BoneOrientations } from "./bone-orientations";
import { FaceDrive } from "./face/face-drive";
import { FingerDrive } from "./hands/finger-drive";
import { SimpleMaterials } from "./materials";
import type { AvatarModel } from "./model";

/** Bone whose position gives the rest direction of another; other bones keep the file's orientation. */
const NEXT_BONE: Readonly<Record<string, string>> = Object.fromEntries(
  ["left", "right"].flatMap((side) => [
    [`${side}UpperArm`, `${side}LowerArm`],
    [`${side}LowerArm`, `${side}Hand`],
    [`${side}Hand`, `${side}MiddleProximal`],
    [`${side}UpperLeg`, `${side}LowerLeg`],
    [`${side}LowerLeg`, `${side}Foot`],
  ]),
);
/** Position of the handle on the hand, as a share of its length from the wrist. */
const PALM_SHARE = 0.4;
/** Length of a hand whose mesh does not show it, as a share of the forearm. */
const DEFAULT_HAND_SHARE = 0.65;
/** Height up to which the audience's camera shows head and hair, in metres on the standard figure: not an antenna's. */
const MAX_FRAMED_HEIGHT_M = 3;
/** Bones of the limbs: shoulder or hip, elbow or knee, wrist or ankle. */
const LIMB_BONES = ["left", "right"]
  .map((side) => [`${side}UpperArm`, `${side}LowerArm`, `${side}Hand`])
  .concat(["left", "right"].map((side) => [`${side}UpperLeg`, `${side}LowerLeg`, `${side}Foot`]));

/** Rotation of a node: its own rest, then the streamed rotation, then into its parent's frame. */
interface BoneDrive {
  node: Object3D;
  /** Offset into the rotations of the driven bones. */
  rotationOffset: number;
  preRotation: Quaternion;
  postRotation: Quaternion;
}

export class Avatar implements Performer {
  readonly group = new Group();
  readonly figure: Figure;
  readonly scale: number;
  readonly height: number;
  readonly root = new Matrix4();
  readonly #model: AvatarModel;
  readonly #materials: SimpleMaterials;
  readonly #drives: BoneDrive[] = [];
  readonly #orientations: BoneOrientations;
  readonly #fingers: FingerDrive;
  readonly #face: FaceDrive;
  readonly #feet: PlantedFeet;
  readonly #rotations: Float64Array;
  readonly #streamedWorld = createWorldTransforms();
  readonly #joints: ReadonlyMap<string, Matrix4>;
  readonly #ankleHeight: number;
  /** Ratio of the avatar's hip height to the figure's. */
  readonly #rootScale: number;
  /** Handle of each limb: a node, a position in its frame, and the figure's metres per metre of the avatar. */
  readonly #handles: readonly { node: Object3D; at: Vector3; distanceScale: number }[];

  constructor(model: AvatarModel, figure: Figure) {
    this.#model = model;
    this.figure = figure;
    this.scale = figureScale(figure);
    this.#joints = new Map(JOINTS.map((name) => [name, new Matrix4()]));
    this.#materials = new SimpleMaterials(model.root);
    this.group.add(model.root);
    const { bones, soleHeight, topHeight, handLengths } = model.rest;
    const positionOf = (bone: string) => (bones.get(bone) as { position: Vector3 }).position;
    const distance = (a: string, b: string) => positionOf(a).distanceTo(positionOf(b));
    const avatarScale =
      totalLimbLength(figure) /
      (distance("leftUpperLeg", "leftLowerLeg") +
        distance("leftLowerLeg", "leftFoot") +
        distance("leftUpperLeg", "leftUpperArm") +
        distance("leftUpperArm", "leftLowerArm") +
        distance("leftLowerArm", "leftHand"));
    model.root.scale.setScalar(avatarScale);
    this.height = Math.min(avatarScale * (topHeight - soleHeight), MAX_FRAMED_HEIGHT_M * this.scale);
    this.#orientations = new BoneOrientations((bone) => model.nodes.has(bone));
    this.#rotations = new Float64Array(this.#orientations.bones.length * 4);
    this.#fingers = new FingerDrive(model, this.#alignBones(figure));
    this.#face = new FaceDrive(model);
    this.#feet = new PlantedFeet(
      this.group,
      ["left", "right"].map((side) => {
        const node = (bone: string) => model.nodes.get(`${side}${bone}`) as Object3D;
        const [, ball] = model.rest.solePoints.get(`${side}Foot`) as readonly Vector3[];
        const hip = node("UpperLeg");
        const { postRotation } = this.#drives.find((drive) => drive.node === hip) as BoneDrive;
        const hinge = new Vector3(1, 0, 0).applyQuaternion(postRotation.clone().invert());
        return { hip, knee: node("LowerLeg"), ankle: node("Foot"), hinge, ball };
      }),
    );

    const rest = restPositions(figure);
    const joint = (name: string) => rest.get(name) as Vector3;
    this.#ankleHeight = joint("l_ankle").y - joint("l_midtarsal").y;
    // The legs are straight in both, as at rest.
    const avatarHipHeight =
      avatarScale *
      (distance("leftUpperLeg", "leftLowerLeg") +
        distance("leftLowerLeg", "leftFoot") +
        positionOf("leftFoot").y -
        soleHeight);
    const legLength = joint("l_hip").distanceTo(joint("l_knee")) + joint("l_knee").distanceTo(joint("l_ankle"));
    this.#rootScale = avatarHipHeight / (legLength + this.#ankleHeight + SOLE_HEIGHT_M * this.scale);
    this.#handles = LIMB_BONES.map(([first, second, third], limb) => {
      const hand = handLengths.get(third) || DEFAULT_HAND_SHARE * distance(second, third);
      const node = model.nodes.get(limb < 2 ? third : second) as Object3D;
      const side = limb % 2 === 0 ? "l" : "r";
      const tip = new Vector3().fromArray(figure.tips, JOINTS.indexOf(`${side}_wrist`) * 3).length();
      const arm =
        joint(`${side}_shoulder`).distanceTo(joint(`${side}_elbow`)) +
        joint(`${side}_elbow`).distanceTo(joint(`${side}_wrist`)) +
        tip;
      const avatarLength =
        limb < 2 ? distance(first, second) + distance(second, third) + hand : distance(first, second);
      const figureLength = limb < 2 ? arm : joint(`${side}_hip`).distanceTo(joint(`${side}_knee`));
      return {
        node,
        at: this.#handleOffset(limb, third, hand),
        distanceScale: figureLength / (avatarLength * avatarScale),
      };
    });
  }

  get ground(): number {
    return floorHeight(this, this.#ankleHeight);
  }

  /** Only the puppet is reflected. */
  set showsReflection(_on: boolean) {}

  set usesSimpleMaterials(on: boolean) {
    this.#materials.useSimple(on);
  }

  apply(pose: StagedPose, seconds: number, blink = 0): void {
    const { figure, group } = this;
    const world = worldTransforms(figure, pose, this.#streamedWorld);
    const { positions, orientations } = world;
    let k = 0;
    for (const matrix of this.#joints.values()) {
      const q = orientations,
        p = positions;
      matrix.compose(
        scratch.set(p[k * 3], p[k * 3 + 1], p[k * 3 + 2]),
        scratchRotation.set(q[k * 4 + 1], q[k * 4 + 2], q[k * 4 + 3], q[k * 4]),
        ONE,
      );
      k++;
    }
    const rotations = this.#rotations;
    this.#orientations.rotations(world, pose.extended ?? null, rotations);
    for (const { node, rotationOffset: at, preRotation, postRotation } of this.#drives) {
      node.quaternion
        .set(rotations[at + 1], rotations[at + 2], rotations[at + 3], rotations[at])
        .premultiply(preRotation)
        .multiply(postRotation);
    }
    this.#fingers.apply(pose.hands ?? null);
    group.position.set(0, 0, 0);
    group.updateMatrixWorld(true);
    const hips = this.#hipCentre(scratchCentre);
    const figureHips = scratch
      .setFromMatrixPosition(this.joint("l_hip"))
      .add(scratchB.setFromMatrixPosition(this.joint("r_hip")))
      .multiplyScalar(0.5);
    group.position.set(
      this.#rootScale * figureHips.x - hips.x,
      this.#streamedLowestY() - this.#avatarLowestY(),
      this.#rootScale * figureHips.z - hips.z,
    );
    group.updateMatrixWorld(true);
    this.#feet.apply(pose.contacts ?? null);
    this.root.copy(this.joint("humanoid_root")).setPosition(this.#hipCentre(scratchCentre));
    this.#face.apply(pose.face ?? null, blink);
    const { vrm } = this.#model;
    if (vrm && seconds === 0) vrm.springBoneManager?.reset();
    vrm?.update(seconds);
  }

  handle(limb: number, out: Vector3): Vector3 {
    const { node, at } = this.#handles[limb];
    return out.copy(at).applyMatrix4(node.matrixWorld);
  }

  hand(limb: number, share: number, out: Matrix4): Matrix4 {
    const { node, at } = this.#handles[limb];
    const { postRotation } = this.#drives.find((drive) => drive.node === node) as BoneDrive;
    // From the axes of the file's bone to those of the figure's joint at rest.
    node.getWorldQuaternion(scratchRotation).multiply(postRotation.clone().invert()).multiply(HAND_TO_JOINT[limb]);
    scratch.copy(at).multiplyScalar(share / PALM_SHARE);
    return out.compose(scratch.applyMatrix4(node.matrixWorld), scratchRotation, ONE);
  }

  readonly joint = (name: string): Matrix4 => this.#joints.get(name) as Matrix4;

  /**
   * The figure's handle is to move from its position as the avatar's has to, scaled by the ratio of their limbs. The
   * difference between the two figures is compensated anew in each frame, so that a hand that follows arrives.
   */
  toStreamedHandle(limb: number, to: Vector3, out: Vector3): Vector3 {
    const offset = to.clone().sub(this.handle(limb, scratchB)).multiplyScalar(this.#handles[limb].distanceScale);
    return handlePosition(this, limb, out).add(offset);
  }

  /** The model stays and can perform with other limb lengths. */
  dispose(): void {
    this.#materials.dispose();
    this.group.removeFromParent();
    this.#model.root.removeFromParent();
  }

  /**
   * Align each limb's rest direction with the figure's, and prepare the rotations of its nodes. Return the rotations
   * from the file's rest to the T-pose by bone.
   */
  #alignBones(figure: Figure): Map<string, Quaternion> {
    const { bones } = this.#model.rest;
    const { offsets, tips } = tPoseFigure(figure);
    const alignments = new Map<string, Quaternion>();
    this.#orientations.bones.forEach((bone, at) => {
      const rest = bones.get(bone);
      const above = this.#orientations.parents[at];
      const parent = alignments.get(this.#orientations.bones[above] ?? "") ?? new Quaternion();
      let alignment = new Quaternion();
      const target = bones.get(NEXT_BONE[bone] ?? "");
      if (rest && target) {
        const next = BONES.indexOf(NEXT_BONE[bone]);
        const figureDirection =
          next < 0
            ? new Vector3().fromArray(tips, BONES.indexOf(bone) * 3)
            : new Vector3().fromArray(offsets, next * 3);
        const direction = target.position.clone().sub(rest.position);
        if (figureDirection.lengthSq() > 0 && direction.lengthSq() > 0)
          alignment.setFromUnitVectors(direction.normalize(), figureDirection.normalize());
      } else if (bone.endsWith("Hand")) {
        alignment = parent.clone();
      }
      alignments.set(bone, alignment);
      const node = this.#model.nodes.get(bone);
      if (!rest || !node) return;
      this.#drives.push({
        node,
        rotationOffset: at * 4,
        preRotation: parent.clone().multiply(rest.parentRotation).invert(),
        postRotation: alignment.clone().multiply(rest.rotation),
      });
    });
    return alignments;
  }

  /** Return the handle's position in the frame of its node at rest: in the palm, or on the knee. */
  #handleOffset(limb: number, hand: string, length: number): Vector3 {
    const { bones } = this.#model.rest;
    const bone = LIMB_BONES[limb][limb < 2 ? 2 : 1];
    const { position, rotation } = bones.get(bone) as { position: Vector3; rotation: Quaternion };
    if (limb >= 2) return new Vector3();
    const previous = bones.get(LIMB_BONES[limb][1]) as { position: Vector3 };
    const fingers = bones.get(NEXT_BONE[hand]);
    const direction = fingers ? fingers.position.clone().sub(position) : position.clone().sub(previous.position);
    const node = this.#model.nodes.get(bone) as Object3D;
    // From the file's metres to the node's units.
    const metresPerUnit = node.getWorldScale(new Vector3()).x / this.#model.root.getWorldScale(new Vector3()).x;
    return direction.setLength((PALM_SHARE * length) / metresPerUnit).applyQuaternion(rotation.clone().invert());
  }

  /** Return the centre of the hip joints in the world frame. */
  #hipCentre(out: Vector3): Vector3 {
    const { nodes } = this.#model;
    out.setFromMatrixPosition((nodes.get("leftUpperLeg") as Object3D).matrixWorld);
    return out
      .add(scratchB.setFromMatrixPosition((nodes.get("rightUpperLeg") as Object3D).matrixWorld))
      .multiplyScalar(0.5);
  }

  /** Return the height of the figure's lowest point: a sole, a knee or a wrist. */
  #streamedLowestY(): number {
    let lowest = this.ground;
    for (const name of ["l_knee", "r_knee", "l_wrist", "r_wrist"])
      lowest = Math.min(lowest, this.joint(name).elements[13]);
    return lowest;
  }

  /** Return the same height for the avatar. */
  #avatarLowestY(): number {
    const { nodes, rest } = this.#model;
    let lowest = Infinity;
    for (const [foot, soles] of rest.solePoints)
      for (const at of soles)
        lowest = Math.min(lowest, solePosition.copy(at).applyMatrix4((nodes.get(foot) as Object3D).matrixWorld).y);
    for (const bone of ["leftLowerLeg", "rightLowerLeg", "leftHand", "rightHand"])
      lowest = Math.min(lowest, (nodes.get(bone) as Object3D).matrixWorld.elements[13]);
    return lowest;
  }
}

/** Rotations of the hands from the T-pose to the figure's rest. */
const HAND_TO_JOINT = [0, 1].map((limb) => {
  const at = TIP_JOINTS[limb + 1] * 4;
  const [w, x, y, z] = T_POSE_TO_REST.subarray(at, at + 4);
  return new Quaternion(x, y, z, w).invert();
});
const ONE = new Vector3(1, 1, 1);
const scratch = new Vector3();
const solePosition = new Vector3();
const scratchB = new Vector3();
const scratchCentre = new Vector3();
const scratchRotation = new Quaternion();
