/**
 * A person's own figure in the puppet's place. Its limbs point where the dancer's of the stream point, whatever pose its file
 * rests in: bone by bone the direction at rest is laid on the dancer's, and the stream's turns are told in the file's own axes.
 * It is as large as the dancer by the lengths of trunk and limbs; its way over the floor is scaled by the ratio of the hips'
 * heights, and its lowest foot is as high as the dancer's, so that feet neither slide nor sink.
 */
import { Group, Matrix4, Quaternion, Vector3, type Object3D } from "three";
import { BONES, emptyHumanoidPose, toHumanoid, tPose } from "../motion/humanoid";
import { emptyWorld, JOINTS, world, type Figure, type Pose } from "../motion/skeleton";
import { figureScale, limbSum, restPositions } from "../stage/fit";
import { footing, handleOf, type Performer } from "../stage/performer";
import { SOLE } from "../stage/standard";
import { PlainMaterials } from "./materials";
import type { AvatarModel } from "./model";
import { drivenParent } from "./rest";

/** The bone whose place says where one points at rest; the others stay as the file has them. */
const POINTS_TO: Readonly<Record<string, string>> = Object.fromEntries(
  ["left", "right"].flatMap((side) => [
    [`${side}UpperArm`, `${side}LowerArm`], [`${side}LowerArm`, `${side}Hand`], [`${side}Hand`, `${side}MiddleProximal`],
    [`${side}UpperLeg`, `${side}LowerLeg`], [`${side}LowerLeg`, `${side}Foot`],
  ]),
);
/** Of a hand's length from the wrist, where it is held. */
const PALM = 0.4;
/** Of the forearm, as long as a hand is whose mesh does not tell. */
const HAND = 0.65;
/** The limbs' bones: shoulder or hip, elbow or knee, wrist or ankle; and the joint of the contract that carries the handle. */
const LIMBS = ["left", "right"].map((side) => [`${side}UpperArm`, `${side}LowerArm`, `${side}Hand`]).concat(["left", "right"].map((side) => [`${side}UpperLeg`, `${side}LowerLeg`, `${side}Foot`]));

/** How a node is turned: first its own rest, then the stream's turn, then into the frame it hangs in. */
interface Drive {
  node: Object3D;
  /** Of the rotations of the humanoid pose. */
  at: number;
  outside: Quaternion;
  inside: Quaternion;
}

export class Avatar implements Performer {
  readonly group = new Group();
  readonly figure: Figure;
  readonly scale: number;
  readonly root = new Matrix4();
  readonly #model: AvatarModel;
  readonly #materials: PlainMaterials;
  readonly #drives: Drive[] = [];
  readonly #human = emptyHumanoidPose();
  readonly #dancer = emptyWorld();
  readonly #joints: ReadonlyMap<string, Matrix4>;
  readonly #ankleHeight: number;
  /** Height of this one's hips to the dancer's. */
  readonly #stride: number;
  /** Where each limb is held: a node and the place in its frame; and the dancer's metres for a metre of this one's. */
  readonly #handles: readonly { node: Object3D; at: Vector3; told: number }[];

  constructor(model: AvatarModel, figure: Figure) {
    this.#model = model;
    this.figure = figure;
    this.scale = figureScale(figure);
    this.#joints = new Map(JOINTS.map((name) => [name, new Matrix4()]));
    this.#materials = new PlainMaterials(model.stand);
    this.group.add(model.stand);
    const { bones, sole, hands } = model.rest;
    const place = (bone: string) => (bones.get(bone) as { place: Vector3 }).place;
    const between = (a: string, b: string) => place(a).distanceTo(place(b));
    const size = limbSum(figure) / (between("leftUpperLeg", "leftLowerLeg") + between("leftLowerLeg", "leftFoot") + between("leftUpperLeg", "leftUpperArm") + between("leftUpperArm", "leftLowerArm") + between("leftLowerArm", "leftHand"));
    model.stand.scale.setScalar(size);
    this.#lay(figure);

    const rest = restPositions(figure);
    const joint = (name: string) => rest.get(name) as Vector3;
    this.#ankleHeight = joint("l_ankle").y - joint("l_midtarsal").y;
    // legs hang straight in both, as the dancer stands
    const standing = size * (between("leftUpperLeg", "leftLowerLeg") + between("leftLowerLeg", "leftFoot") + place("leftFoot").y - sole);
    const leg = joint("l_hip").distanceTo(joint("l_knee")) + joint("l_knee").distanceTo(joint("l_ankle"));
    this.#stride = standing / (leg + this.#ankleHeight + SOLE * this.scale);
    this.#handles = LIMBS.map(([first, second, third], limb) => {
      const hand = hands.get(third) || HAND * between(second, third);
      const node = model.nodes.get(limb < 2 ? third : second) as Object3D;
      const side = limb % 2 === 0 ? "l" : "r";
      const tip = new Vector3().fromArray(figure.tips, JOINTS.indexOf(`${side}_wrist`) * 3).length();
      const arm = joint(`${side}_shoulder`).distanceTo(joint(`${side}_elbow`)) + joint(`${side}_elbow`).distanceTo(joint(`${side}_wrist`)) + tip;
      const own = limb < 2 ? between(first, second) + between(second, third) + hand : between(first, second);
      const dancers = limb < 2 ? arm : joint(`${side}_hip`).distanceTo(joint(`${side}_knee`));
      return { node, at: this.#held(limb, third, hand), told: dancers / (own * size) };
    });
  }

  get ground(): number {
    return footing(this, this.#ankleHeight);
  }

  /** Only the puppet is reflected. */
  set reflected(_on: boolean) {}

  set plain(on: boolean) {
    this.#materials.show(on);
  }

  apply(pose: Pose, seconds: number): void {
    const { figure, group } = this;
    const { positions, orientations } = world(figure, pose, this.#dancer);
    let k = 0;
    for (const matrix of this.#joints.values()) {
      const q = orientations, p = positions;
      matrix.compose(scratch.set(p[k * 3], p[k * 3 + 1], p[k * 3 + 2]), turn.set(q[k * 4 + 1], q[k * 4 + 2], q[k * 4 + 3], q[k * 4]), ONE);
      k++;
    }
    const { rotations } = toHumanoid(figure, pose, this.#human);
    for (const { node, at, outside, inside } of this.#drives) {
      node.quaternion.set(rotations[at + 1], rotations[at + 2], rotations[at + 3], rotations[at]).premultiply(outside).multiply(inside);
    }
    group.position.set(0, 0, 0);
    group.updateMatrixWorld(true);
    const hips = this.#hips(middle);
    const dancers = scratch.setFromMatrixPosition(this.joint("l_hip")).add(turned.setFromMatrixPosition(this.joint("r_hip"))).multiplyScalar(0.5);
    group.position.set(this.#stride * dancers.x - hips.x, this.#lowest() - this.#own(), this.#stride * dancers.z - hips.z);
    group.updateMatrixWorld(true);
    this.root.copy(this.joint("humanoid_root")).setPosition(this.#hips(middle));
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
  told(limb: number, to: Vector3, out: Vector3): Vector3 {
    const way = to.clone().sub(this.handle(limb, turned)).multiplyScalar(this.#handles[limb].told);
    return handleOf(this, limb, out).add(way);
  }

  /** The model itself stays, to dance again for another dancer's lengths. */
  dispose(): void {
    this.#materials.dispose();
    this.group.removeFromParent();
    this.#model.stand.removeFromParent();
  }

  /** Lays each limb's direction at rest on the dancer's, and prepares how its nodes are turned from there. */
  #lay(figure: Figure): void {
    const { bones } = this.#model.rest;
    const { offsets, tips } = tPose(figure);
    const laid = new Map<string, Quaternion>();
    BONES.forEach((bone, at) => {
      const rest = bones.get(bone);
      const above = drivenParent(bone);
      const parent = (above && laid.get(above)) || new Quaternion();
      let lay = new Quaternion();
      const target = bones.get(POINTS_TO[bone] ?? "");
      if (rest && target) {
        const next = BONES.indexOf(POINTS_TO[bone]);
        const wanted = next < 0 ? new Vector3().fromArray(tips, at * 3) : new Vector3().fromArray(offsets, next * 3);
        const direction = target.place.clone().sub(rest.place);
        if (wanted.lengthSq() > 0 && direction.lengthSq() > 0) lay.setFromUnitVectors(direction.normalize(), wanted.normalize());
      } else if (bone.endsWith("Hand")) {
        lay = parent.clone();
      }
      laid.set(bone, lay);
      const node = this.#model.nodes.get(bone);
      if (!rest || !node) return;
      this.#drives.push({ node, at: at * 4, outside: parent.clone().multiply(rest.parent).invert(), inside: lay.clone().multiply(rest.rotation) });
    });
  }

  /** Where a limb is held, in the frame of its node at rest: in the palm, or on the knee. */
  #held(limb: number, hand: string, length: number): Vector3 {
    const { bones } = this.#model.rest;
    const bone = LIMBS[limb][limb < 2 ? 2 : 1];
    const { place, rotation } = bones.get(bone) as { place: Vector3; rotation: Quaternion };
    if (limb >= 2) return new Vector3();
    const from = bones.get(LIMBS[limb][1]) as { place: Vector3 };
    const fingers = bones.get(POINTS_TO[hand]);
    const along = fingers ? fingers.place.clone().sub(place) : place.clone().sub(from.place);
    const node = this.#model.nodes.get(bone) as Object3D;
    // from the file's metres into the node's own
    const metre = node.getWorldScale(new Vector3()).x / this.#model.stand.getWorldScale(new Vector3()).x;
    return along.setLength((PALM * length) / metre).applyQuaternion(rotation.clone().invert());
  }

  /** The middle of the hips' joints as they stand, world. */
  #hips(out: Vector3): Vector3 {
    const { nodes } = this.#model;
    out.setFromMatrixPosition((nodes.get("leftUpperLeg") as Object3D).matrixWorld);
    return out.add(turned.setFromMatrixPosition((nodes.get("rightUpperLeg") as Object3D).matrixWorld)).multiplyScalar(0.5);
  }

  /** Height of what is lowest of the dancer: a sole, a knee or a wrist. */
  #lowest(): number {
    let lowest = this.ground;
    for (const name of ["l_knee", "r_knee", "l_wrist", "r_wrist"]) lowest = Math.min(lowest, this.joint(name).elements[13]);
    return lowest;
  }

  /** The same of this one, as it stands now. */
  #own(): number {
    const { nodes, rest } = this.#model;
    let lowest = Infinity;
    for (const [foot, soles] of rest.soles) for (const at of soles) lowest = Math.min(lowest, scratchSole.copy(at).applyMatrix4((nodes.get(foot) as Object3D).matrixWorld).y);
    for (const bone of ["leftLowerLeg", "rightLowerLeg", "leftHand", "rightHand"]) lowest = Math.min(lowest, (nodes.get(bone) as Object3D).matrixWorld.elements[13]);
    return lowest;
  }
}

const ONE = new Vector3(1, 1, 1);
const scratch = new Vector3();
const scratchSole = new Vector3();
const turned = new Vector3();
const middle = new Vector3();
const turn = new Quaternion();
