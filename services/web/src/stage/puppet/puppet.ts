/** The puppet: bones named as H-Anim names the joints, one skinned mesh over them, and by night its reflection. */
import {
  Bone,
  type BufferGeometry,
  Group,
  type Material,
  Matrix4,
  Skeleton,
  SkinnedMesh,
  Sphere,
  type Vector3,
} from "three";
import { type Figure, JOINTS, PARENTS, type Pose } from "../../motion/skeleton";
import { figureScale, restPositions } from "./figure-fit";
import { floorHeight, handlePosition, type Performer } from "./performer";
import { BONES, type PuppetAssets } from "./puppet-assets";
import { SleeveBone } from "./sleeve-bone";
import { SIDES } from "./standard-figure";

export class Puppet implements Performer {
  readonly group = new Group();
  readonly figure: Figure;
  readonly scale: number;
  /** How far the ankle stands above the ball of the foot at rest, metres. */
  readonly #ankleHeight: number;
  readonly #bones: Bone[];
  readonly #sleeves: SleeveBone[];
  readonly #assets: PuppetAssets;
  readonly #mesh: SkinnedMesh<BufferGeometry, Material>;
  readonly #reflection: SkinnedMesh<BufferGeometry, Material>;

  constructor(figure: Figure, workshop: PuppetAssets) {
    this.figure = figure;
    this.#assets = workshop;
    this.scale = figureScale(figure);
    this.#ankleHeight = -figure.offsets[JOINTS.indexOf("l_midtarsal") * 3 + 1];
    this.group.name = "puppet";
    this.#bones = createBones(figure);
    this.group.add(this.#bone("humanoid_root"), this.#bone("l_sleeve"), this.#bone("r_sleeve"));
    this.group.updateMatrixWorld(true);
    const skeleton = new Skeleton(this.#bones);
    const shape = workshop.geometryFor(figure);
    this.#mesh = new SkinnedMesh(shape, workshop.material);
    this.#mesh.name = "figure";
    this.#mesh.castShadow = true;
    this.#mesh.receiveShadow = true;
    this.#reflection = new SkinnedMesh(shape, workshop.mirroredMaterial);
    this.#reflection.renderOrder = -1;
    for (const mesh of [this.#mesh, this.#reflection]) {
      mesh.bind(skeleton, new Matrix4());
      mesh.frustumCulled = false;
      // else three.js bends all of it to find where it is among what it sorts
      mesh.boundingSphere = new Sphere();
    }
    this.group.add(this.#mesh);
    const rest = restPositions(figure);
    this.#sleeves = SIDES.map(({ side }) => {
      const along = (rest.get(`${side}_elbow`) as Vector3).clone().sub(rest.get(`${side}_shoulder`) as Vector3);
      const joints = {
        shoulder: this.#bone(`${side}_shoulder`),
        elbow: this.#bone(`${side}_elbow`),
        chest: this.#bone("vl5"),
      };
      return new SleeveBone(this.#bone(`${side}_sleeve`), side, joints, along);
    });
  }

  get root(): Matrix4 {
    return this.#bones[0].matrixWorld;
  }

  get ground(): number {
    return floorHeight(this, this.#ankleHeight);
  }

  set showsReflection(on: boolean) {
    // Taken away, not hidden: what is hidden has its shader compiled all the same.
    if (on) this.group.add(this.#reflection);
    else this.#reflection.removeFromParent();
  }

  set usesSimpleMaterials(on: boolean) {
    this.#mesh.material = on ? this.#assets.simpleMaterial : this.#assets.material;
  }

  apply(pose: Pose, seconds: number): void {
    this.#bones[0].position.fromArray(pose.root);
    for (let k = 0; k < JOINTS.length; k++) {
      const q = pose.rotations;
      this.#bones[k].quaternion.set(q[k * 4 + 1], q[k * 4 + 2], q[k * 4 + 3], q[k * 4]);
    }
    this.#bones[0].updateWorldMatrix(true, true);
    for (const sleeve of this.#sleeves) sleeve.update(seconds);
  }

  handle(limb: number, out: Vector3): Vector3 {
    return handlePosition(this, limb, out);
  }

  readonly joint = (name: string): Matrix4 => this.#bone(name).matrixWorld;

  /** The puppet is the dancer of the stream. */
  toStreamedHandle(_limb: number, to: Vector3, out: Vector3): Vector3 {
    return out.copy(to);
  }

  /** What it is made of is its workshop's. */
  dispose(): void {
    this.#mesh.skeleton.dispose();
    this.group.removeFromParent();
  }

  #bone(name: string): Bone {
    return this.#bones[BONES.indexOf(name)];
  }
}

function createBones(figure: Figure): Bone[] {
  const bones = BONES.map((name) => {
    const bone = new Bone();
    bone.name = name;
    return bone;
  });
  JOINTS.forEach((_, k) => {
    bones[k].position.fromArray(figure.offsets, k * 3);
    if (PARENTS[k] >= 0) bones[PARENTS[k]].add(bones[k]);
  });
  const rest = restPositions(figure);
  for (const { side } of SIDES)
    bones[BONES.indexOf(`${side}_sleeve`)].position.copy(rest.get(`${side}_shoulder`) as Vector3);
  return bones;
}
