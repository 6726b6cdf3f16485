/** A file that was read: what is drawn of it, its humanoid's nodes, and how it stands. Comes with three-vrm, and so only when it is asked for. */
import { type VRM, VRMLoaderPlugin, VRMUtils } from "@pixiv/three-vrm";
import { Group, type Material, Mesh, type Object3D, TextureLoader, Vector3 } from "three";
import { GLTFLoader } from "three/examples/jsm/loaders/GLTFLoader.js";
import { fileBroken } from "./error";
import { parseAvatarFile } from "./file";
import { dimMToonMaterials, simplifyMaterials } from "./materials";
import { measureRest, type RestMeasurements } from "./rest-pose";

/** Bones nearer to each other than this share of the height have no direction. */
const MIN_BONE_SHARE = 1e-4;
const LIMB_BONES = ["Arm", "Leg"].flatMap((limb) =>
  ["left", "right"].map((side) => [
    `${side}Upper${limb}`,
    `${side}Lower${limb}`,
    `${side}${limb === "Arm" ? "Hand" : "Foot"}`,
  ]),
);

export class AvatarModel {
  /** Holds the file's scene; turned to face z, and scaled by who dances in it. */
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
      // the bounds of a mesh are those of its rest
      object.frustumCulled = false;
    });
    dimMToonMaterials(materials);
    simplifyMaterials(materials);
  }

  /** Reads a GLB or VRM file; `called` is its name where the file has none. Throws AvatarProblem where it cannot dance. */
  static async parse(bytes: ArrayBuffer, fallbackName: string): Promise<AvatarModel> {
    const { vrm, name, bones } = parseAvatarFile(bytes);
    const loader = new GLTFLoader();
    loader.register((parser) => {
      // pictures as elements: the page's policy allows these from memory, and fetching nothing but its own server's
      parser.textureLoader = new TextureLoader(parser.options.manager);
      return { name: "pictures as elements" };
    });
    if (vrm) loader.register((parser) => new VRMLoaderPlugin(parser, { autoUpdateHumanBones: false }));
    try {
      const gltf = await loader.parseAsync(bytes, "");
      const nodes = new Map<string, Object3D>();
      for (const [bone, index] of bones) nodes.set(bone, (await gltf.parser.getDependency("node", index)) as Object3D);
      const read = new AvatarModel(
        name ?? fallbackName,
        nodes,
        (gltf.userData.vrm as VRM | undefined) ?? null,
        gltf.scene,
      );
      read.#checkLimbs();
      return read;
    } catch (error) {
      throw fileBroken(
        `what it should show could not be read (${error instanceof Error ? error.message : String(error)})`,
      );
    }
  }

  dispose(): void {
    this.root.removeFromParent();
    VRMUtils.deepDispose(this.root);
  }

  /** Throws where limbs have no length: then they have no direction either. */
  #checkLimbs(): void {
    const at = (bone: string) => this.rest.bones.get(bone)?.position ?? new Vector3(NaN);
    const height = at("head").y - this.rest.soleHeight;
    for (const limb of LIMB_BONES) {
      for (let k = 0; k < 2; k++) {
        if (!(at(limb[k]).distanceTo(at(limb[k + 1])) > MIN_BONE_SHARE * height))
          throw new Error(`${limb[k]} and ${limb[k + 1]} are in one place`);
      }
    }
  }
}
