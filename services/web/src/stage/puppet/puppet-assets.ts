/** Shared assets of the puppets of one stage: materials for all, one mesh for equal limb lengths. */
import {
  type Camera,
  type IUniform,
  type Material,
  type Matrix4,
  type Scene,
  type ShaderMaterial,
  Vector3,
} from "three";
import { type Figure, figureKey, JOINTS } from "../../motion/skeleton";
import { type DistantLights, updateDistantLights } from "./distant-lights";
import { fitToFigure } from "./figure-fit";
import { GeometryBuilder, type PuppetGeometry } from "./geometry-builder";
import { createFigureMaterial, createSimpleFigureMaterial, type PuppetTextures } from "./material";
import { addArms } from "./parts/arms";
import { addBodice } from "./parts/bodice";
import { addHakama } from "./parts/hakama";
import { addHead } from "./parts/head";
import { addLegs } from "./parts/legs";
import { addSleeves } from "./parts/sleeves";

/** Bones in the order of the geometry's skin indices: the joints of the contract, then the two sleeves. */
export const BONES: readonly string[] = [...JOINTS, "l_sleeve", "r_sleeve"];

const centre = new Vector3();

/** Build all parts on a figure in its rest pose. Needs no graphics context. */
export function buildPuppetGeometry(figure: Figure): PuppetGeometry {
  const builder = new GeometryBuilder(BONES, fitToFigure(figure));
  for (const add of [addLegs, addArms, addHead, addBodice, addHakama, addSleeves]) add(builder);
  return builder.build();
}

export class PuppetAssets {
  readonly material: Material;
  /** Material of the reflection. */
  readonly mirroredMaterial: Material;
  readonly #textures: PuppetTextures;
  #simpleMaterial: ShaderMaterial | null = null;
  readonly #geometries = new Map<string, PuppetGeometry>();

  /** `floorAt` is the height of the reflecting floor. */
  constructor(textures: PuppetTextures, floorHeight: IUniform<number>) {
    this.#textures = textures;
    this.material = createFigureMaterial(textures);
    this.mirroredMaterial = createFigureMaterial(textures, floorHeight);
  }

  /** Material for machines without a graphics processor. */
  get simpleMaterial(): Material {
    return (this.#simpleMaterial ??= createSimpleFigureMaterial(this.#textures));
  }

  /** Light the simple material as a performer gets it whose root is there. Called before each draw. */
  lightSimpleMaterial(scene: Scene, camera: Camera, root: Matrix4): void {
    if (!this.#simpleMaterial) return;
    updateDistantLights(
      this.#simpleMaterial.uniforms as DistantLights,
      scene,
      camera,
      centre.setFromMatrixPosition(root),
    );
    this.#simpleMaterial.uniformsNeedUpdate = true;
  }

  /** Return the meshes for a figure, built once per set of limb lengths. */
  geometryFor(figure: Figure): PuppetGeometry {
    const key = figureKey(figure);
    let geometry = this.#geometries.get(key);
    if (!geometry) this.#geometries.set(key, (geometry = buildPuppetGeometry(figure)));
    return geometry;
  }

  /** Dispose of the meshes of all other figures. */
  retainOnly(figures: readonly Figure[]): void {
    const keysToKeep = new Set(figures.map(figureKey));
    for (const [key, geometry] of this.#geometries) {
      if (keysToKeep.has(key)) continue;
      geometry.detailed.dispose();
      geometry.coarse.dispose();
      this.#geometries.delete(key);
    }
  }

  dispose(): void {
    this.retainOnly([]);
    for (const material of [this.material, this.mirroredMaterial, this.#simpleMaterial]) material?.dispose();
  }
}
