/** The puppet: bones named like the H-Anim joints, one skinned mesh, and a reflection in the night look. */
import {
  Bone,
  BufferGeometry,
  Group,
  type Material,
  Matrix4,
  Quaternion,
  Skeleton,
  SkinnedMesh,
  Sphere,
  Vector3,
} from "three";
import type { StagedPose } from "../../motion/extension";
import { createWorldTransforms, type Figure, JOINTS, PARENTS, worldTransforms } from "../../motion/skeleton";
import { STANDING_HEIGHT_M } from "../camera/audience-camera";
import { ExtendedBones, TRUNK_BONES } from "./extended-bones";
import { figureScale, restPositions } from "./figure-fit";
import { floorHeight, handlePosition, type Performer } from "./performer";
import type { PuppetAssets } from "./puppet-assets";
import { BONES } from "./puppet-geometry";
import { SleeveBone } from "./sleeve-bone";
import { SIDES } from "./standard-figure";

const rotation = new Quaternion();

export class Puppet implements Performer {
  readonly group = new Group();
  readonly figure: Figure;
  readonly scale: number;
  /** Height of the ankle above the ball of the foot at rest, in metres. */
  readonly #ankleHeight: number;
  readonly #bones: Bone[];
  readonly #sleeves: SleeveBone[];
  readonly #extendedBones: ExtendedBones;
  /** World matrices of the streamed figure's joints, while an extension moves the bones elsewhere. */
  readonly #streamedJoints = new Map<string, Matrix4>();
  readonly #streamedWorld = createWorldTransforms();
  #isExtended = false;
  readonly #assets: PuppetAssets;
  readonly #mesh: SkinnedMesh<BufferGeometry, Material>;
  readonly #reflection: SkinnedMesh<BufferGeometry, Material>;

  constructor(figure: Figure, assets: PuppetAssets, usesSimpleMaterials = false) {
    this.figure = figure;
    this.#assets = assets;
    this.scale = figureScale(figure);
    this.#ankleHeight = -figure.offsets[JOINTS.indexOf("l_midtarsal") * 3 + 1];
    this.group.name = "puppet";
    this.#bones = createBones(figure);
    this.#extendedBones = new ExtendedBones(figure, (name) => this.#bone(name));
    this.group.add(this.#bone("humanoid_root"), this.#bone("l_sleeve"), this.#bone("r_sleeve"));
    this.group.updateMatrixWorld(true);
    const skeleton = new Skeleton(this.#bones);
    this.#mesh = new SkinnedMesh(new BufferGeometry(), assets.material);
    this.#mesh.name = "figure";
    this.#mesh.castShadow = true;
    this.#mesh.receiveShadow = true;
    this.#reflection = new SkinnedMesh(new BufferGeometry(), assets.mirroredMaterial);
    this.#reflection.renderOrder = -1;
    for (const mesh of [this.#mesh, this.#reflection]) {
      mesh.bind(skeleton, new Matrix4());
      mesh.frustumCulled = false;
      // Without a bounding sphere three.js skins the whole mesh to find its depth for sorting.
      mesh.boundingSphere = new Sphere();
    }
    this.usesSimpleMaterials = usesSimpleMaterials;
    this.#mesh.onBeforeRender = (_renderer, scene, camera) => assets.lightSimpleMaterial(scene, camera, this.root);
    this.group.add(this.#mesh);
    const rest = restPositions(figure);
    this.#sleeves = SIDES.map(({ side }) => {
      const along = (rest.get(`${side}_elbow`) as Vector3).clone().sub(rest.get(`${side}_shoulder`) as Vector3);
      const joints = {
        shoulder: this.#bone(`${side}_shoulder`),
        elbow: this.#bone(`${side}_elbow`),
        chest: this.#bone("chest"),
      };
      return new SleeveBone(this.#bone(`${side}_sleeve`), side, joints, along);
    });
  }

  get root(): Matrix4 {
    return this.#bones[0].matrixWorld;
  }

  get height(): number {
    return STANDING_HEIGHT_M * this.scale;
  }

  get ground(): number {
    return floorHeight(this, this.#ankleHeight);
  }

  set showsReflection(on: boolean) {
    // Removed, not hidden: the shader of a hidden mesh is compiled all the same.
    if (on) this.group.add(this.#reflection);
    else this.#reflection.removeFromParent();
  }

  set usesSimpleMaterials(on: boolean) {
    this.#mesh.material = on ? this.#assets.simpleMaterial : this.#assets.material;
    const geometry = this.#assets.geometryFor(this.figure, on ? "coarse" : "full");
    this.#mesh.geometry = this.#reflection.geometry = geometry;
  }

  apply(pose: StagedPose, seconds: number): void {
    if (this.#isExtended && !pose.extended) this.#extendedBones.reset();
    this.#isExtended = Boolean(pose.extended);
    this.#bones[0].position.fromArray(pose.root);
    for (let k = 0; k < JOINTS.length; k++) {
      const q = pose.rotations;
      this.#bones[k].quaternion.set(q[k * 4 + 1], q[k * 4 + 2], q[k * 4 + 3], q[k * 4]);
    }
    if (pose.extended) {
      this.#extendedBones.apply(pose.extended);
      this.#updateStreamedJoints(pose);
    }
    this.#bones[0].updateWorldMatrix(true, true);
    for (const sleeve of this.#sleeves) sleeve.update(seconds);
  }

  handle(limb: number, out: Vector3): Vector3 {
    return handlePosition({ joint: (name) => this.#bone(name).matrixWorld, scale: this.scale }, limb, out);
  }

  readonly joint = (name: string): Matrix4 =>
    (this.#isExtended && this.#streamedJoints.get(name)) || this.#bone(name).matrixWorld;

  /** The figure's handle is to move as the drawn one has to, which an extension may carry elsewhere. */
  toStreamedHandle(limb: number, to: Vector3, out: Vector3): Vector3 {
    const offset = to.clone().sub(this.handle(limb, new Vector3()));
    return handlePosition(this, limb, out).add(offset);
  }

  /** Geometry and materials belong to the shared assets. */
  dispose(): void {
    this.#mesh.skeleton.dispose();
    this.group.removeFromParent();
  }

  #updateStreamedJoints(pose: StagedPose): void {
    const { positions, orientations } = worldTransforms(this.figure, pose, this.#streamedWorld);
    JOINTS.forEach((name, k) => {
      const matrix = this.#streamedJoints.get(name) ?? new Matrix4();
      this.#streamedJoints.set(name, matrix);
      rotation.set(orientations[k * 4 + 1], orientations[k * 4 + 2], orientations[k * 4 + 3], orientations[k * 4]);
      matrix
        .makeRotationFromQuaternion(rotation)
        .setPosition(positions[k * 3], positions[k * 3 + 1], positions[k * 3 + 2]);
    });
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
  for (const name of TRUNK_BONES) bones[JOINTS.indexOf("vl5")].add(bones[BONES.indexOf(name)]);
  const rest = restPositions(figure);
  for (const { side } of SIDES)
    bones[BONES.indexOf(`${side}_sleeve`)].position.copy(rest.get(`${side}_shoulder`) as Vector3);
  return bones;
}
