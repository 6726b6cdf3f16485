/** The puppet: bones named like the H-Anim joints, one skinned mesh, and a reflection in the night look. */
import {
  Bone,
  BufferGeometry,
  type Camera,
  Group,
  type Material,
  Matrix4,
  type Scene,
  Skeleton,
  SkinnedMesh,
  Sphere,
  Vector3,
  type WebGLRenderer,
} from "three";
import type { StagedPose } from "../../motion/extension";
import { type Figure, JOINTS, PARENTS, TIP_JOINTS } from "../../motion/skeleton";
import { STANDING_HEIGHT_M } from "../camera/audience-camera";
import type { Look } from "../scenery/look";
import { BONES, FACE_BONE, TRUNK_BONES } from "./bones";
import { figureScale, fitFingers, restPositions } from "./figure-fit";
import { FINGER_BONES, SEGMENTS, wristOf } from "./hand/finger-joints";
import { LightTable } from "./light-table";
import { floorHeight, handlePosition, type Performer } from "./performer";
import type { PlantedFeet } from "./planted-feet";
import type { PuppetAssets } from "./puppet-assets";
import type { PuppetExtension } from "./puppet-extension";
import { SimpleFigureMaterial } from "./simple-material";
import { SleeveBone } from "./sleeve-bone";
import { SIDES } from "./standard-figure";

/** Class of the movements that load later; null until they are loaded. */
let Extension: typeof PuppetExtension | null = null;

/** Give all puppets the movements of trunk, fingers and face, so that they need not load them. */
export function setPuppetExtension(extension: typeof PuppetExtension): void {
  Extension = extension;
}

/** Class of the correction of planted feet; null until it is loaded. */
let Feet: typeof PlantedFeet | null = null;

/** Give all puppets the correction of planted feet, so that they need not load it. */
export function setPlantedFeet(feet: typeof PlantedFeet): void {
  Feet = feet;
}

export class Puppet implements Performer {
  readonly group = new Group();
  readonly figure: Figure;
  readonly scale: number;
  /** Height of the ankle above the ball of the foot at rest, in metres. */
  readonly #ankleHeight: number;
  readonly #bones: Bone[];
  readonly #sleeves: SleeveBone[];
  /** Positions of the finger tips from their last joints, at rest. */
  readonly #fingerTips: Vector3[];
  /** Null until a pose needed it. */
  #extension: PuppetExtension | null = null;
  #isLoading = false;
  /** Null until a pose has contacts. */
  #feet: PlantedFeet | null = null;
  #isLoadingFeet = false;
  readonly #assets: PuppetAssets;
  readonly #mesh: SkinnedMesh<BufferGeometry, Material | Material[]>;
  readonly #reflection: SkinnedMesh<BufferGeometry, Material>;
  /** Light for the simple material, null if it was never used. */
  #lightTable: LightTable | null = null;

  constructor(figure: Figure, assets: PuppetAssets, usesSimpleMaterials = false) {
    this.figure = figure;
    this.#assets = assets;
    this.scale = figureScale(figure);
    this.#ankleHeight = -figure.offsets[JOINTS.indexOf("l_midtarsal") * 3 + 1];
    this.group.name = "puppet";
    const fingers = fitFingers(figure);
    this.#bones = createBones(figure, fingers);
    this.#fingerTips = fingers.map(([, , last, tip]) => tip.clone().sub(last));
    const face = this.#bone(FACE_BONE);
    this.group.add(this.#bone("humanoid_root"), this.#bone("l_sleeve"), this.#bone("r_sleeve"), face);
    this.group.updateMatrixWorld(true);
    const skeleton = new Skeleton(this.#bones);
    // Its elements are those of the expression, 0 at rest.
    face.matrixWorldAutoUpdate = false;
    face.matrixWorld.multiplyScalar(0);
    this.#mesh = new SkinnedMesh<BufferGeometry, Material | Material[]>(new BufferGeometry(), assets.material);
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
    this.#mesh.onBeforeRender = (_renderer, _scene, camera, _geometry, material) => {
      if (this.#lightTable && material instanceof SimpleFigureMaterial)
        material.prepare(skeleton, this.#lightTable.texture, camera);
    };
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
    if (on) this.#lightTable ??= new LightTable();
    this.#mesh.material = on ? [...this.#assets.simpleMaterials] : this.#assets.material;
    const geometry = this.#assets.geometryFor(this.figure, on ? "coarse" : "full");
    this.#mesh.geometry = this.#reflection.geometry = geometry;
  }

  prepare(renderer: WebGLRenderer, scene: Scene, camera: Camera, look: Look): void {
    if (this.#lightTable && Array.isArray(this.#mesh.material))
      this.#lightTable.update(renderer, scene, camera, look, this.root);
  }

  invalidate(): void {
    this.#lightTable?.invalidate();
  }

  apply(pose: StagedPose, seconds: number, blink = 0): void {
    if (!this.#extension && (pose.extended || pose.hands || pose.face || blink > 0)) void this.#extend();
    this.#extension?.prepare(pose);
    this.#bones[0].position.fromArray(pose.root);
    for (let k = 0; k < JOINTS.length; k++) {
      const q = pose.rotations;
      this.#bones[k].quaternion.set(q[k * 4 + 1], q[k * 4 + 2], q[k * 4 + 3], q[k * 4]);
    }
    this.#extension?.apply(pose, blink);
    this.#bones[0].updateWorldMatrix(true, true);
    if (pose.contacts && !this.#feet) void this.#loadFeet();
    this.#feet?.apply(pose.contacts ?? null);
    for (const sleeve of this.#sleeves) sleeve.update(seconds);
  }

  handle(limb: number, out: Vector3): Vector3 {
    return handlePosition({ joint: (name) => this.#bone(name).matrixWorld, scale: this.scale }, limb, out);
  }

  hand(limb: number, share: number, out: Matrix4): Matrix4 {
    const joint = TIP_JOINTS[limb + 1];
    const tip = new Vector3().fromArray(this.figure.tips, joint * 3).multiplyScalar(share);
    out.copy(this.#bones[joint].matrixWorld);
    return out.setPosition(tip.applyMatrix4(out));
  }

  readonly joint = (name: string): Matrix4 => this.#extension?.streamedJoint(name) ?? this.#bone(name).matrixWorld;

  /** The figure's handle is to move as the drawn one has to, which an extension may carry elsewhere. */
  toStreamedHandle(limb: number, to: Vector3, out: Vector3): Vector3 {
    const offset = to.clone().sub(this.handle(limb, new Vector3()));
    return handlePosition(this, limb, out).add(offset);
  }

  /** Geometry and materials belong to the shared assets. */
  dispose(): void {
    this.#lightTable?.dispose();
    this.#mesh.skeleton.dispose();
    this.group.removeFromParent();
  }

  /** Load the movements of trunk, fingers and face, unless another puppet did. */
  async #extend(): Promise<void> {
    if (!Extension) {
      if (this.#isLoading) return;
      this.#isLoading = true;
      // If this fails, the puppet moves without them; the next one tries again.
      Extension = await import("./puppet-extension").then(
        (loaded) => loaded.PuppetExtension,
        () => null,
      );
    }
    if (Extension) this.#extension = new Extension(this.figure, (name) => this.#bone(name), this.#fingerTips);
  }

  /** Load the correction of planted feet, unless another puppet did. */
  async #loadFeet(): Promise<void> {
    if (!Feet) {
      if (this.#isLoadingFeet) return;
      this.#isLoadingFeet = true;
      // If this fails, the feet are as in the motion; the next puppet tries again.
      Feet = await import("./planted-feet").then(
        (loaded) => loaded.PlantedFeet,
        () => null,
      );
    }
    if (!Feet) return;
    const legs = SIDES.map(({ side }) => ({
      hip: this.#bone(`${side}_hip`),
      knee: this.#bone(`${side}_knee`),
      ankle: this.#bone(`${side}_ankle`),
      hinge: new Vector3(1, 0, 0),
      ball: this.#bone(`${side}_midtarsal`).position,
    }));
    this.#feet = new Feet(this.#bones[0], legs);
  }

  #bone(name: string): Bone {
    return this.#bones[BONES.indexOf(name)];
  }
}

function createBones(figure: Figure, fingers: readonly (readonly Vector3[])[]): Bone[] {
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
  FINGER_BONES.forEach((name, index) => {
    const [chain, place] = [Math.floor(index / SEGMENTS), index % SEGMENTS];
    const parent = place === 0 ? wristOf(name) : FINGER_BONES[index - 1];
    const parentAt = place === 0 ? (rest.get(parent) as Vector3) : fingers[chain][place - 1];
    const bone = bones[BONES.indexOf(name)];
    bone.position.copy(fingers[chain][place]).sub(parentAt);
    // They move only with data.
    bone.matrixAutoUpdate = false;
    bone.updateMatrix();
    bones[BONES.indexOf(parent)].add(bone);
  });
  for (const { side } of SIDES)
    bones[BONES.indexOf(`${side}_sleeve`)].position.copy(rest.get(`${side}_shoulder`) as Vector3);
  return bones;
}
