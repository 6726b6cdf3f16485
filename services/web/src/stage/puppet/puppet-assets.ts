/** Where puppets are carved and dressed: those of one stage share their materials, and those of equal lengths their mesh. */
import type { BufferGeometry, IUniform, Material } from "three";
import { type Figure, figureKey, JOINTS } from "../../motion/skeleton";
import { fitToFigure } from "./figure-fit";
import { GeometryBuilder } from "./geometry-builder";
import { createFigureMaterial, createSimpleFigureMaterial, type PuppetTextures } from "./material";
import { addArms } from "./parts/arms";
import { addBodice } from "./parts/bodice";
import { addHakama } from "./parts/hakama";
import { addHead } from "./parts/head";
import { addLegs } from "./parts/legs";
import { addSleeves } from "./parts/sleeves";

/** Bones in the order of the geometry's skin indices: the joints of the contract, then the two sleeves. */
export const BONES: readonly string[] = [...JOINTS, "l_sleeve", "r_sleeve"];

/** All parts on one dancer's figure, in its rest pose. Pure: takes no graphics context. */
export function buildPuppetGeometry(figure: Figure): BufferGeometry {
  const assembly = new GeometryBuilder(BONES, fitToFigure(figure));
  for (const add of [addLegs, addArms, addHead, addBodice, addHakama, addSleeves]) add(assembly);
  return assembly.build();
}

export class PuppetAssets {
  readonly material: Material;
  /** Of the reflection. */
  readonly mirroredMaterial: Material;
  readonly #textures: PuppetTextures;
  #simpleMaterial: Material | null = null;
  readonly #geometries = new Map<string, BufferGeometry>();

  /** `floorAt` holds the height of the floor that reflects. */
  constructor(paint: PuppetTextures, floorAt: IUniform<number>) {
    this.#textures = paint;
    this.material = createFigureMaterial(paint);
    this.mirroredMaterial = createFigureMaterial(paint, floorAt);
  }

  /** For machines without a graphics processor. */
  get simpleMaterial(): Material {
    return (this.#simpleMaterial ??= createSimpleFigureMaterial(this.#textures));
  }

  /** The mesh of a dancer's lengths, carved once. */
  geometryFor(figure: Figure): BufferGeometry {
    const key = figureKey(figure);
    let shape = this.#geometries.get(key);
    if (!shape) this.#geometries.set(key, (shape = buildPuppetGeometry(figure)));
    return shape;
  }

  /** Gives back the meshes of all lengths but these. */
  retainOnly(figures: readonly Figure[]): void {
    const kept = new Set(figures.map(figureKey));
    for (const [key, shape] of this.#geometries) {
      if (kept.has(key)) continue;
      shape.dispose();
      this.#geometries.delete(key);
    }
  }

  dispose(): void {
    this.retainOnly([]);
    for (const material of [this.material, this.mirroredMaterial, this.#simpleMaterial]) material?.dispose();
  }
}
