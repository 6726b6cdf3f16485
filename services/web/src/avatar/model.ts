/**
 * A loaded avatar file: its scene, the nodes of its humanoid and its rest pose. The module includes three-vrm and is
 * loaded on demand.
 */
import { type VRM, VRMLoaderPlugin, VRMUtils } from "@pixiv/three-vrm";
import { Group, type Material, Mesh, type Object3D, TextureLoader, Vector3 } from "three";
import { GLTFLoader } from "three/examples/jsm/loaders/GLTFLoader.js";
import { fileBroken } from "./error";
import { parseAvatarFile } from "./file";
import { dimMToonMaterials, simplifyMaterials } from "./materials";
import { measureRest, type RestMeasurements } from "./rest-pose";

/** Minimum distance between two bones, as a share of the height: shorter, a bone has no direction. */
const MIN_BONE_SHARE = 1e-4;
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

  private constructor(
    readonly name: string,
    readonly nodes: ReadonlyMap<string, Object3D>,
    readonly vrm: VRM | null,
    scene: Group,
  ) {
    this.root.name = "avatar";
    this.root.add(scene);
    this.rest = measureRest(this.root, nodes);
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
    const { vrm, name, bones } = parseAvatarFile(bytes);
    const loader = new GLTFLoader();
    // Textures as image elements where there are any: an embedding page's content security policy may allow fetches
    // from servers alone. Workers fetch their textures from memory, which our own policy allows.
    if (typeof Image !== "undefined")
      loader.register((parser) => {
        parser.textureLoader = new TextureLoader(parser.options.manager);
        return { name: "textures as image elements" };
      });
    if (vrm) loader.register((parser) => new VRMLoaderPlugin(parser, { autoUpdateHumanBones: false }));
    try {
      const gltf = await loader.parseAsync(bytes, "");
      const nodes = new Map<string, Object3D>();
      for (const [bone, index] of bones) nodes.set(bone, (await gltf.parser.getDependency("node", index)) as Object3D);
      const model = new AvatarModel(
        name ?? fallbackName,
        nodes,
        (gltf.userData.vrm as VRM | undefined) ?? null,
        gltf.scene,
      );
      model.#checkLimbs();
      return model;
    } catch (error) {
      throw fileBroken(`its content could not be read (${error instanceof Error ? error.message : String(error)})`);
    }
  }

  dispose(): void {
    this.root.removeFromParent();
    VRMUtils.deepDispose(this.root);
  }

  /** Throw if a limb has no length, and therefore no direction. */
  #checkLimbs(): void {
    const at = (bone: string) => this.rest.bones.get(bone)?.position ?? new Vector3(NaN);
    const height = at("head").y - this.rest.soleHeight;
    for (const limb of LIMB_BONES) {
      for (let k = 0; k < 2; k++) {
        if (!(at(limb[k]).distanceTo(at(limb[k + 1])) > MIN_BONE_SHARE * height))
          throw new Error(`${limb[k]} and ${limb[k + 1]} are at the same position`);
      }
    }
  }
}
