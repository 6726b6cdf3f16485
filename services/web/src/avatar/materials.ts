/** How an avatar's materials take the stage's light. */
import type { MToonMaterial } from "@pixiv/three-vrm";
import {
  type Material,
  Mesh,
  MeshLambertMaterial,
  type MeshPhysicalMaterial,
  MeshStandardMaterial,
  type Object3D,
} from "three";

/** Of a cartoon's colours, in the light and in the shade. */
const LIT_COLOUR_SCALE = 0.55;
const SHADE_COLOUR_SCALE = 0.15;

/** Cartoons (MToon) take all of a light wherever it comes from, from behind as shade: before the stage's four they would be washed out. */
export function dimMToonMaterials(materials: Iterable<Material>): void {
  for (const material of materials) {
    if (!("isMToonMaterial" in material)) continue;
    const { color, shadeColorFactor } = material as MToonMaterial;
    color.multiplyScalar(LIT_COLOUR_SCALE);
    shadeColorFactor.multiplyScalar(SHADE_COLOUR_SCALE);
  }
}

/** What is left to see of clear glass, as an opacity. */
const GLASS_OPACITY = 0.25;

/** Materials as the stage can draw them: without what its shaders were freed of (`lean-three.ts`), with which they would be drawn wrongly or not at all. Glass is thin. */
export function simplifyMaterials(materials: Iterable<Material>): void {
  for (const material of materials) {
    if (material instanceof MeshStandardMaterial)
      material.bumpMap = material.lightMap = material.alphaMap = material.displacementMap = null;
    if (!("isMeshPhysicalMaterial" in material)) continue;
    const physical = material as MeshPhysicalMaterial;
    if (physical.transmission > 0) {
      physical.opacity *= 1 - (1 - GLASS_OPACITY) * physical.transmission;
      physical.transparent = true;
    }
    physical.transmission = physical.dispersion = physical.iridescence = 0;
  }
}

/** Plain materials for machines that draw in software: colours and light, without gloss, bumps and reflections. */
export class SimpleMaterials {
  readonly #originals = new Map<Mesh, Material | Material[]>();
  readonly #simple = new Map<Material, Material>();

  constructor(model: Object3D) {
    model.traverse((object) => {
      if (object instanceof Mesh) this.#originals.set(object, object.material as Material | Material[]);
    });
  }

  /** Puts the model's own materials on it, or plain ones in the place of those that shade physically. */
  useSimple(plain: boolean): void {
    const wanted = (material: Material) => (plain ? this.#simpleOf(material) : material);
    for (const [mesh, material] of this.#originals)
      mesh.material = Array.isArray(material) ? material.map(wanted) : wanted(material);
  }

  dispose(): void {
    this.useSimple(false);
    for (const [material, plain] of this.#simple) if (plain !== material) plain.dispose();
    this.#simple.clear();
  }

  #simpleOf(material: Material): Material {
    let plain = this.#simple.get(material);
    if (!plain) {
      plain = material;
      if (material instanceof MeshStandardMaterial) {
        const {
          name,
          color,
          map,
          alphaMap,
          emissive,
          emissiveMap,
          emissiveIntensity,
          vertexColors,
          side,
          transparent,
          opacity,
          alphaTest,
          depthWrite,
        } = material;
        plain = new MeshLambertMaterial({
          name,
          color,
          map,
          alphaMap,
          emissive,
          emissiveMap,
          emissiveIntensity,
          vertexColors,
          side,
          transparent,
          opacity,
          alphaTest,
          depthWrite,
        });
      }
      this.#simple.set(material, plain);
    }
    return plain;
  }
}
