/** Adaptation of an avatar's materials to the stage's lights. */
import type { MToonMaterial } from "@pixiv/three-vrm";
import {
  type Material,
  Mesh,
  MeshLambertMaterial,
  type MeshPhysicalMaterial,
  MeshStandardMaterial,
  type Object3D,
} from "three";

/** Scale of MToon colours, lit and shaded. */
const LIT_COLOUR_SCALE = 0.55;
const SHADE_COLOUR_SCALE = 0.15;

/**
 * Darken MToon (cartoon) materials: they take the full intensity of a light from any direction, from behind as shade,
 * so that four lights would overexpose them.
 */
export function dimMToonMaterials(materials: Iterable<Material>): void {
  for (const material of materials) {
    if (!("isMToonMaterial" in material)) continue;
    const { color, shadeColorFactor } = material as MToonMaterial;
    color.multiplyScalar(LIT_COLOUR_SCALE);
    shadeColorFactor.multiplyScalar(SHADE_COLOUR_SCALE);
  }
}

/** Opacity that stands for clear glass. */
const GLASS_OPACITY = 0.25;

/**
 * Remove material features that the stage does not render: bump, light, alpha and displacement maps, iridescence,
 * dispersion, and transmission, which would need another render pass. Clear glass becomes transparent instead.
 */
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

/** Simple materials for software rendering: colours and light, without gloss, bumps and reflections. */
export class SimpleMaterials {
  readonly #originals = new Map<Mesh, Material | Material[]>();
  readonly #simple = new Map<Material, Material>();

  constructor(model: Object3D) {
    model.traverse((object) => {
      if (object instanceof Mesh) this.#originals.set(object, object.material as Material | Material[]);
    });
  }

  /** Switch between the model's own materials and simple replacements of those with physical shading. */
  useSimple(simple: boolean): void {
    const select = (material: Material) => (simple ? this.#simpleOf(material) : material);
    for (const [mesh, material] of this.#originals)
      mesh.material = Array.isArray(material) ? material.map(select) : select(material);
  }

  dispose(): void {
    this.useSimple(false);
    for (const [material, simple] of this.#simple) if (simple !== material) simple.dispose();
    this.#simple.clear();
  }

  #simpleOf(material: Material): Material {
    let simple = this.#simple.get(material);
    if (!simple) {
      simple = material;
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
        simple = new MeshLambertMaterial({
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
      this.#simple.set(material, simple);
    }
    return simple;
  }
}
