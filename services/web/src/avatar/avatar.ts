/**
 * A person's own figure in the puppet's place. Its limbs point where the dancer's of the stream point, whatever pose its file
 * rests in: bone by bone the direction at rest is laid on the dancer's, and the stream's turns are told in the file's own axes.
 * It is as large as the dancer by the lengths of trunk and limbs; its way over the floor is scaled by the ratio of the hips'
 * heights, and its lowest foot is as high as the dancer's, so that feet neither slide nor sink.
 */
import { Group, Matrix4, type Object3D, Quaternion, Vector3 } from "three";
import { BONES, createHumanoidPose, toHumanoid, tPoseFigure } from "../motion/humanoid";
import { createWorldTransforms, type Figure, JOINTS, type Pose, worldTransforms } from "../motion/skeleton";
import { figureScale, restPositions, totalLimbLength } from "../stage/puppet/figure-fit";
import { floorHeight, handlePosition, type Performer } from "../stage/puppet/performer";
import { SOLE_HEIGHT_M } from "../stage/puppet/standard-figure";
import { SimpleMaterials } from "./materials";
import type { AvatarModel } from "./model";
import { drivenParent } from "./rest-pose";

/** The bone whose place says where one points at rest; the others stay as the file has them. */
const NEXT_BONE: Readonly<Record<string, string>> = Object.fromEntries(
  ["left", "right"].flatMap((side) => [
    [`${side}UpperArm`, `${side}LowerArm`],
    [`${side}LowerArm`, `${side}Hand`],
    [`${side}Hand`, `${side}MiddleProximal`],
    [`${side}UpperLeg`, `${side}LowerLeg`],
    [`${side}LowerLeg`, `${side}Foot`],
  ]),
);
/** Of a hand's length from the wrist, where it is held. */
const PALM_SHARE = 0.4;
/** Of the forearm, as long as a hand is whose mesh does not tell. */
const DEFAULT_HAND_SHARE = 0.65;
/** The limbs' bones: shoulder or hip, elbow or knee, wrist or ankle; and the joint of the contract that carries the handle. */
const LIMB_BONES = ["left", "right"]
  .map((side) => [`${side}UpperArm`, `${side}LowerArm`, `${side}Hand`])
  .concat(["left", "right"].map((side) => [`${side}UpperLeg`, `${side}LowerLeg`, `${side}Foot`]));

/** How a node is turned: first its own rest, then the stream's turn, then into the frame it hangs in. */
interface BoneDrive {
  node: Object3D;
  /** Of the rotations of the humanoid pose. */
  rotationOffset: number;
  preRotation: Quaternion;
  postRotation: Quaternion;
}

export class Avatar implements Performer {
  readonly group = new Group();
  readonly figure: Figure;
  readonly scale: number;
  readonly root = new Matrix4();
  readonly #model: AvatarModel;
  readonly #materials: SimpleMaterials;
  readonly #drives: BoneDrive[] = [];
  readonly #humanoidPose = createHumanoidPose();
  readonly #streamedWorld = createWorldTransforms();
  readonly #joints: ReadonlyMap<string, Matrix4>;
  readonly #ankleHeight: number;
  /** Height of this one's hips to the dancer's. */
  readonly #rootScale: number;
  /** Where each limb is held: a node and the place in its frame; and the dancer's metres for a metre of this one's. */
  readonly #handles: readonly { node: Object3D; at: Vector3; told: number }[];

  constructor(model: AvatarModel, figure: Figure) {
    this.#model = model;
    this.figure = figure;
    this.scale = figureScale(figure);
    this.#joints = new Map(JOINTS.map((name) => [name, new Matrix4()]));
    this.#materials = new SimpleMaterials(model.root);
    this.group.add(model.root);
    const { bones, soleHeight: sole, handLengths: hands } = model.rest;
    const place = (bone: string) => (bones.get(bone) as { position: Vector3 }).position;
    const between = (a: string, b: string) => place(a).distanceTo(place(b));
    const size =
      totalLimbLength(figure) /
      (between("leftUpperLeg", "leftLowerLeg") +
        between("leftLowerLeg", "leftFoot") +
        between("leftUpperLeg", "leftUpperArm") +
        between("leftUpperArm", "leftLowerArm") +
        between("leftLowerArm", "leftHand"));
    model.root.scale.setScalar(size);
    this.#alignBones(figure);

    const rest = restPositions(figure);
    const joint = (name: string) => rest.get(name) as Vector3;
    this.#ankleHeight = joint("l_ankle").y - joint("l_midtarsal").y;
    // legs hang straight in both, as the dancer stands
    const standing =
      size *
      (between("leftUpperLeg", "leftLowerLeg") + between("leftLowerLeg", "leftFoot") + place("leftFoot").y - sole);
    const leg = joint("l_hip").distanceTo(joint("l_knee")) + joint("l_knee").distanceTo(joint("l_ankle"));
    this.#rootScale = standing / (leg + this.#ankleHeight + SOLE_HEIGHT_M * this.scale);
    this.#handles = LIMB_BONES.map(([first, second, third], limb) => {
      const hand = hands.get(third) || DEFAULT_HAND_SHARE * between(second, third);
      const node = model.nodes.get(limb < 2 ? third : second) as Object3D;
      const side = limb % 2 === 0 ? "l" : "r";
      const tip = new Vector3().fromArray(figure.tips, JOINTS.indexOf(`${side}_wrist`) * 3).length();
      const arm =
        joint(`${side}_shoulder`).distanceTo(joint(`${side}_elbow`)) +
        joint(`${side}_elbow`).distanceTo(joint(`${side}_wrist`)) +
        tip;
      const own = limb < 2 ? between(first, second) + between(second, third) + hand : between(first, second);
      const dancers = limb < 2 ? arm : joint(`${side}_hip`).distanceTo(joint(`${side}_knee`));
      return { node, at: this.#handleOffset(limb, third, hand), told: dancers / (own * size) };
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

  apply(pose: Pose, seconds: number): void {
    const { figure, group } = this;
    const { positions, orientations } = worldTransforms(figure, pose, this.#streamedWorld);
    let k = 0;
    for (const matrix of this.#joints.values()) {
      const q = orientations,
        p = positions;
      matrix.compose(
        scratch.set(p[k * 3], p[k * 3 + 1], p[k * 3 + 2]),
        turn.set(q[k * 4 + 1], q[k * 4 + 2], q[k * 4 + 3], q[k * 4]),
        ONE,
      );
      k++;
    }
    const { rotations } = toHumanoid(figure, pose, this.#humanoidPose);
    for (const { node, rotationOffset: at, preRotation: outside, postRotation: inside } of this.#drives) {
      node.quaternion
        .set(rotations[at + 1], rotations[at + 2], rotations[at + 3], rotations[at])
        .premultiply(outside)
        .multiply(inside);
    }
    group.position.set(0, 0, 0);
    group.updateMatrixWorld(true);
    const hips = this.#hipCentre(middle);
    const dancers = scratch
      .setFromMatrixPosition(this.joint("l_hip"))
      .add(turned.setFromMatrixPosition(this.joint("r_hip")))
      .multiplyScalar(0.5);
    group.position.set(
      this.#rootScale * dancers.x - hips.x,
      this.#streamedLowestY() - this.#avatarLowestY(),
      this.#rootScale * dancers.z - hips.z,
    );
    group.updateMatrixWorld(true);
    this.root.copy(this.joint("humanoid_root")).setPosition(this.#hipCentre(middle));
    const { vrm } = this.#model;
    if (vrm && seconds === 0) vrm.springBoneManager?.reset();
    vrm?.update(seconds);
  }

  handle(limb: number, out: Vector3): Vector3 {
    const { node, at } = this.#handles[limb];
    return out.copy(at).applyMatrix4(node.matrixWorld);
  }

  readonly joint = (name: string): Matrix4 => this.#joints.get(name) as Matrix4;

  /**
   * The dancer's handle is to go from where it is as this one's has to go, in the measure of their limbs: what differs between
   * the two figures is so told anew with each frame, and a hand that follows arrives.
   */
  toStreamedHandle(limb: number, to: Vector3, out: Vector3): Vector3 {
    const way = to.clone().sub(this.handle(limb, turned)).multiplyScalar(this.#handles[limb].told);
    return handlePosition(this, limb, out).add(way);
  }

  /** The model itself stays, to dance again for another dancer's lengths. */
  dispose(): void {
    this.#materials.dispose();
    this.group.removeFromParent();
    this.#model.root.removeFromParent();
  }

  /** Lays each limb's direction at rest on the dancer's, and prepares how its nodes are turned from there. */
  #alignBones(figure: Figure): void {
    const { bones } = this.#model.rest;
    const { offsets, tips } = tPoseFigure(figure);
    const laid = new Map<string, Quaternion>();
    BONES.forEach((bone, at) => {
      const rest = bones.get(bone);
      const above = drivenParent(bone);
      const parent = (above && laid.get(above)) || new Quaternion();
      let lay = new Quaternion();
      const target = bones.get(NEXT_BONE[bone] ?? "");
      if (rest && target) {
        const next = BONES.indexOf(NEXT_BONE[bone]);
        const wanted = next < 0 ? new Vector3().fromArray(tips, at * 3) : new Vector3().fromArray(offsets, next * 3);
        const direction = target.position.clone().sub(rest.position);
        if (wanted.lengthSq() > 0 && direction.lengthSq() > 0)
          lay.setFromUnitVectors(direction.normalize(), wanted.normalize());
      } else if (bone.endsWith("Hand")) {
        lay = parent.clone();
      }
      laid.set(bone, lay);
      const node = this.#model.nodes.get(bone);
      if (!rest || !node) return;
      this.#drives.push({
        node,
        rotationOffset: at * 4,
        preRotation: parent.clone().multiply(rest.parentRotation).invert(),
        postRotation: lay.clone().multiply(rest.rotation),
      });
    });
  }

  /** Where a limb is held, in the frame of its node at rest: in the palm, or on the knee. */
  #handleOffset(limb: number, hand: string, length: number): Vector3 {
    const { bones } = this.#model.rest;
    const bone = LIMB_BONES[limb][limb < 2 ? 2 : 1];
    const { position: place, rotation } = bones.get(bone) as { position: Vector3; rotation: Quaternion };
    if (limb >= 2) return new Vector3();
    const from = bones.get(LIMB_BONES[limb][1]) as { position: Vector3 };
    const fingers = bones.get(NEXT_BONE[hand]);
    const along = fingers ? fingers.position.clone().sub(place) : place.clone().sub(from.position);
    const node = this.#model.nodes.get(bone) as Object3D;
    // from the file's metres into the node's own
    const metre = node.getWorldScale(new Vector3()).x / this.#model.root.getWorldScale(new Vector3()).x;
    return along.setLength((PALM_SHARE * length) / metre).applyQuaternion(rotation.clone().invert());
  }

  /** The middle of the hips' joints as they stand, world. */
  #hipCentre(out: Vector3): Vector3 {
    const { nodes } = this.#model;
    out.setFromMatrixPosition((nodes.get("leftUpperLeg") as Object3D).matrixWorld);
    return out
      .add(turned.setFromMatrixPosition((nodes.get("rightUpperLeg") as Object3D).matrixWorld))
      .multiplyScalar(0.5);
  }

  /** Height of what is lowest of the dancer: a sole, a knee or a wrist. */
  #streamedLowestY(): number {
    let lowest = this.ground;
    for (const name of ["l_knee", "r_knee", "l_wrist", "r_wrist"])
      lowest = Math.min(lowest, this.joint(name).elements[13]);
    return lowest;
  }

  /** The same of this one, as it stands now. */
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

const ONE = new Vector3(1, 1, 1);
const scratch = new Vector3();
const solePosition = new Vector3();
const turned = new Vector3();
const middle = new Vector3();
const turn = new Quaternion();
