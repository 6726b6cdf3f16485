/** Shared assets of the puppets of one stage: materials for all, one mesh for equal limb lengths. */
import {
  type BufferGeometry,
  type Camera,
  type IUniform,
  type Material,
  type Matrix4,
  type Scene,
  type ShaderMaterial,
  Vector3,
} from "three";
import { type Figure, figureKey } from "../../motion/skeleton";
import { type DistantLights, updateDistantLights } from "./distant-lights";
import { createFigureMaterial, createSimpleFigureMaterial, type PuppetTextures } from "./material";
import { takePuppetGeometry } from "./puppet-geometry";
import type { Detail } from "./surface";

const centre = new Vector3();

export class PuppetAssets {
  readonly material: Material;
  /** Material of the reflection. */
  readonly mirroredMaterial: Material;
  readonly #textures: PuppetTextures;
  #simpleMaterial: ShaderMaterial | null = null;
  /** Meshes by the limb lengths of their figure. */
  readonly #geometries = new Map<string, Map<Detail, BufferGeometry>>();

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
    for (const material of [this.material, this.mirroredMaterial, this.#simpleMaterial]) material?.dispose();
  }
}
