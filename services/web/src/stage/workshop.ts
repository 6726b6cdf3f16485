/** Where puppets are carved and dressed: those of one stage share their materials, and those of equal lengths their mesh. */
import type { BufferGeometry, IUniform, Material } from "three";
import { JOINTS, lengthsOf, type Figure } from "../motion/skeleton";
import { Assembly } from "./assembly";
import { fitTo } from "./fit";
import { addArms } from "./parts/arms";
import { addBodice } from "./parts/bodice";
import { addHakama } from "./parts/hakama";
import { addHead } from "./parts/head";
import { addLegs } from "./parts/legs";
import { addSleeves } from "./parts/sleeves";
import { figureMaterial, plainFigureMaterial, type Paint } from "./shading";

/** Bones in the order of the geometry's skin indices: the joints of the contract, then the two sleeves. */
export const BONES: readonly string[] = [...JOINTS, "l_sleeve", "r_sleeve"];

/** All parts on one dancer's figure, in its rest pose. Pure: takes no graphics context. */
export function puppetGeometry(figure: Figure): BufferGeometry {
  const assembly = new Assembly(BONES, fitTo(figure));
  for (const add of [addLegs, addArms, addHead, addBodice, addHakama, addSleeves]) add(assembly);
  return assembly.geometry();
}

export class Workshop {
  readonly full: Material;
  /** Of the reflection. */
  readonly mirrored: Material;
  readonly #paint: Paint;
  #plain: Material | null = null;
  readonly #shapes = new Map<string, BufferGeometry>();

  /** `floorAt` holds the height of the floor that reflects. */
  constructor(paint: Paint, floorAt: IUniform<number>) {
    this.#paint = paint;
    this.full = figureMaterial(paint);
    this.mirrored = figureMaterial(paint, floorAt);
  }

  /** For machines without a graphics processor. */
  get plain(): Material {
    return (this.#plain ??= plainFigureMaterial(this.#paint));
  }

  /** The mesh of a dancer's lengths, carved once. */
  shape(figure: Figure): BufferGeometry {
    const key = lengthsOf(figure);
    let shape = this.#shapes.get(key);
    if (!shape) this.#shapes.set(key, (shape = puppetGeometry(figure)));
    return shape;
  }

  /** Gives back the meshes of all lengths but these. */
  keep(figures: readonly Figure[]): void {
    const kept = new Set(figures.map(lengthsOf));
    for (const [key, shape] of this.#shapes) {
      if (kept.has(key)) continue;
      shape.dispose();
      this.#shapes.delete(key);
    }
  }

  dispose(): void {
    this.keep([]);
    for (const material of [this.full, this.mirrored, this.#plain]) material?.dispose();
  }
}
