/**
 * A loaded avatar file: its scene, the nodes of its humanoid and its rest pose. The module includes three-vrm and is
 * loaded on demand.
 */
import { type VRM, VRMLoaderPlugin, VRMUtils } from "@pixiv/three-vrm";
import { type BufferGeometry, Group, type Material, Mesh, type Object3D, TextureLoader, Vector3 } from "three";
import { type GLTF, GLTFLoader, type GLTFParser } from "three/examples/jsm/loaders/GLTFLoader.js";
import { translate } from "../i18n/translator";
import { Decoders } from "./decoding/decoders";
import { AvatarError, fileBroken } from "./error";
import { type EyeBone, findEyeBones } from "./face/eye-bones";
import { type AvatarFile, parseAvatarFile } from "./file";
import { dimMToonMaterials, simplifyMaterials } from "./materials";
import { FINGER_BONES, measureRest, type RestMeasurements } from "./rest-pose";
import { findTrunkBones } from "./trunk-bones";

/** Minimum distance between two bones, as a share of the height: shorter, a bone has no direction. */
const MIN_BONE_SHARE = 1e-4;
/** Longest bone of a body, as a multiple of the median, and its height as a multiple of that. */
const MAX_BONE_RATIO = 20;
/** Distances in the trunk on which the size of an avatar depends. */
const TRUNK_BONES = [
  ["hips", "head"],
  ["leftUpperLeg", "leftUpperArm"],
  ["rightUpperLeg", "rightUpperArm"],
];
const LIMB_BONES = ["Arm", "Leg"].flatMap((limb) =>
  ["left", "right"].map((side) => [
    `${side}Upper${limb}`,
    `${side}Lower${limb}`,
    `${side}${limb === "Arm" ? "Hand" : "Foot"}`,
  ]),
);

export class AvatarModel {
  /** Contains the file's scene, rotated to face z; an avatar scales it. */
  readonly root = new Group();
  readonly rest: RestMeasurements;
  /** Bones of the eyes, if the file has both. */
  readonly eyes: readonly EyeBone[];

  private constructor(
    readonly name: string,
    readonly nodes: ReadonlyMap<string, Object3D>,
    readonly vrm: VRM | null,
    scene: Group,
  ) {
    this.root.name = "avatar";
    this.root.add(scene);
    this.rest = measureRest(this.root, nodes);
    this.eyes = findEyeBones(nodes);
    const materials = new Set<Material>();
    scene.traverse((object) => {
      if (!(object instanceof Mesh)) return;
      for (const material of [object.material].flat()) materials.add(material);
      object.castShadow = object.receiveShadow = true;
      // The bounds of a mesh are those of its rest pose.
      object.frustumCulled = false;
    });
    dimMToonMaterials(materials);
    simplifyMaterials(materials);
  }

  /**
   * Parse a GLB or VRM file; `fallbackName` is used if the file has no name. Throw AvatarError if it cannot be used.
   */
  static async parse(bytes: ArrayBuffer, fallbackName: string): Promise<AvatarModel> {
    const file = parseAvatarFile(bytes);
    const loader = new GLTFLoader();
    const imageErrors = new Map<number, unknown>();
    loader.register((parser) => {
      // Textures as image elements where there are any: an embedding page's content security policy may allow fetches
      // from servers alone. Workers fetch their textures from memory, which our own policy allows.
      if (typeof Image !== "undefined") parser.textureLoader = new TextureLoader(parser.options.manager);
      recordImageErrors(parser, imageErrors);
      return { name: "images" };
    });
    if (file.vrm) loader.register((parser) => new VRMLoaderPlugin(parser, { autoUpdateHumanBones: false }));
    const decoders = await Decoders.create(loader, file.compressions);
    let model: AvatarModel | null = null;
    try {
      const gltf = await Promise.race([loader.parseAsync(bytes, ""), decoders.failure]);
      for (const [image, error] of imageErrors) throw new Error(`images[${image}]: ${messageOf(error)}`);
      model = await AvatarModel.#create(gltf, file, fallbackName);
      model.#checkMeshes();
      model.#checkBody();
      return model;
    } catch (error) {
      model?.dispose();
      throw error instanceof AvatarError
        ? error
        : fileBroken(translate("its content could not be read: {reason}", { reason: messageOf(error) }));
    } finally {
      decoders.dispose();
    }
  }

  static async #create(gltf: GLTF, { bones, name }: AvatarFile, fallbackName: string): Promise<AvatarModel> {
    const nodes = new Map<string, Object3D>();
    for (const [bone, index] of bones) nodes.set(bone, (await gltf.parser.getDependency("node", index)) as Object3D);
    // what the file declares comes before its tree
    for (const [bone, node] of findTrunkBones(nodes)) if (!nodes.has(bone)) nodes.set(bone, node);
    return new AvatarModel(name ?? fallbackName, nodes, (gltf.userData.vrm as VRM | undefined) ?? null, gltf.scene);
  }

  dispose(): void {
    this.root.removeFromParent();
    VRMUtils.deepDispose(this.root);
  }

  /** Throw if a mesh cannot be drawn. */
  #checkMeshes(): void {
    this.root.traverse((object) => {
      if (!(object instanceof Mesh)) return;
      const { index, attributes } = object.geometry as BufferGeometry;
      const { position } = attributes;
      const vertexCount = position.count;
      for (let at = 0; at < vertexCount; at++)
        if (!Number.isFinite(position.getX(at) + position.getY(at) + position.getZ(at)))
          throw new Error(`${object.name}: POSITION[${at}] is not finite`);
      for (let at = 0; at < (index?.count ?? 0); at++)
        if (Number(index?.getX(at)) >= vertexCount) throw new Error(`${object.name}: indices[${at}] is no vertex`);
    });
  }

  /** Throw if the bones or the extent are those of no body: an avatar takes its size and directions from them. */
  #checkBody(): void {
    const at = (bone: string) => this.rest.bones.get(bone)?.position ?? new Vector3(NaN);
    const { soleHeight, topHeight } = this.rest;
    const height = at("head").y - soleHeight;
    const bones = [
      ...LIMB_BONES.flatMap(([first, second, third]) => [
        [first, second],
        [second, third],
      ]),
      ...TRUNK_BONES,
    ];
    const lengths = bones.map(([start, end]) => at(start).distanceTo(at(end)));
    const longest = MAX_BONE_RATIO * lengths.toSorted((a, b) => a - b)[lengths.length >> 1];
    for (const [index, [start, end]] of bones.entries()) {
      if (!(lengths[index] > MIN_BONE_SHARE * height)) throw new Error(`${start} and ${end} are at the same position`);
      if (!(lengths[index] < longest)) throw new Error(`${start} and ${end} are too far apart for a body`);
    }
    for (const [bone, node] of this.nodes) {
      if (!isBelow(node, this.root)) throw new Error(`${bone} is not in the scene`);
      if (!FINGER_BONES.includes(bone) && !(Math.abs(node.matrixWorld.determinant()) > 0))
        throw new Error(`${bone} is scaled to nothing`);
    }
    // A hand's mesh gives the position of its handle.
    const extents = [topHeight - soleHeight, ...this.rest.handLengths.values()];
    if (!extents.every((extent) => extent < longest * MAX_BONE_RATIO))
      throw new Error("its vertices are too far apart for a body");
  }
}

/** Make a parser write errors of images into `errors` by index; it would leave out their textures. */
function recordImageErrors(parser: GLTFParser, errors: Map<number, unknown>): void {
  const load = parser.loadImageSource;
  parser.loadImageSource = async function (index, loader) {
    try {
      return await load.call(this, index, loader);
    } catch (error) {
      errors.set(index, error);
      throw error;
    }
  };
}

function isBelow(node: Object3D, ancestor: Object3D): boolean {
  for (let at: Object3D | null = node; at; at = at.parent) if (at === ancestor) return true;
  return false;
}

/** Return the message of an error, or of what a decoder sends in its place. */
function messageOf(error: unknown): string {
  const { message = null, error: inner = null } = (error ?? {}) as { message?: unknown; error?: unknown };
  return String(message ?? inner ?? error);
}
