/** Shared assets of the puppets of one stage: materials for all, one mesh for equal limb lengths. */
import type { BufferGeometry, IUniform, Material } from "three";
import { type Figure, figureKey } from "../../motion/skeleton";
import { MATERIAL_PARTS } from "./finish";
import { createFigureMaterial, type PuppetTextures } from "./material";
import { takePuppetGeometry } from "./puppet-geometry";
import { SimpleFigureMaterial } from "./simple-material";
import type { Detail } from "./surface";

export class PuppetAssets {
  readonly material: Material;
  /** Material of the reflection. */
  readonly mirroredMaterial: Material;
  readonly #textures: PuppetTextures;
  #simpleMaterials: readonly SimpleFigureMaterial[] | null = null;
  /** Meshes by the limb lengths of their figure. */
  readonly #geometries = new Map<string, Map<Detail, BufferGeometry>>();

  /** `floorAt` is the height of the reflecting floor. */
  constructor(textures: PuppetTextures, floorHeight: IUniform<number>) {
    this.#textures = textures;
    this.material = createFigureMaterial(textures);
    this.mirroredMaterial = createFigureMaterial(textures, floorHeight);
  }

  /** Materials of the groups of the mesh for machines without a graphics processor. */
  get simpleMaterials(): readonly SimpleFigureMaterial[] {
    return (this.#simpleMaterials ??= MATERIAL_PARTS.map((part) => new SimpleFigureMaterial(this.#textures, part)));
  }

  /** Return the mesh for a figure, built once per set of limb lengths. */
  geometryFor(figure: Figure, detail: Detail): BufferGeometry {
    const key = figureKey(figure);
    const ofFigure = this.#geometries.get(key) ?? new Map<Detail, BufferGeometry>();
    this.#geometries.set(key, ofFigure);
    const geometry = ofFigure.get(detail) ?? takePuppetGeometry(figure, detail);
    ofFigure.set(detail, geometry);
    return geometry;
  }

  /** Dispose of the meshes of all other figures. */
  retainOnly(figures: readonly Figure[]): void {
    const keysToKeep = new Set(figures.map(figureKey));
    for (const [key, ofFigure] of this.#geometries) {
      if (keysToKeep.has(key)) continue;
      for (const geometry of ofFigure.values()) geometry.dispose();
      this.#geometries.delete(key);
    }
  }

  dispose(): void {
    this.retainOnly([]);
    for (const material of [this.material, this.mirroredMaterial, ...(this.#simpleMaterials ?? [])]) material.dispose();
  }
}
