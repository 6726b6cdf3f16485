/**
 * Triangles of a large mesh in tiles, of which only those in view are drawn, for software rendering: it would compute
 * the corners of all others, too.
 */
import {
  type BufferAttribute,
  type BufferGeometry,
  type Camera,
  DynamicDrawUsage,
  Frustum,
  Matrix4,
  Sphere,
  Uint16BufferAttribute,
  Vector3,
} from "three";
import { orderTriangles } from "./triangle-order";

/** Indices of a tile: 16 triangles. */
const TILE_LENGTH = 48;

interface Tile {
  readonly indices: readonly number[];
  readonly bounds: Sphere;
}

const toClip = new Matrix4();
const frustum = new Frustum();

export class CulledTriangles {
  readonly #index: Uint16BufferAttribute;
  #groups: readonly (readonly Tile[])[] = [];

  /** Take the triangles of `geometry`, as its only group, until others are set. */
  constructor(private readonly geometry: BufferGeometry) {
    const { array } = geometry.index as BufferAttribute;
    this.#index = new Uint16BufferAttribute(array.length, 1).setUsage(DynamicDrawUsage);
    geometry.setIndex(this.#index);
    this.triangles = [Array.from(array)];
  }

  /**
   * Set the triangles (indices of their corners) of the mesh's groups, and draw them all. Those close to each other are
   * to be neighbours.
   */
  set triangles(groups: readonly (readonly number[])[]) {
    this.#groups = groups.map((triangles) =>
      Array.from({ length: Math.ceil(triangles.length / TILE_LENGTH) }, (_, tile) =>
        this.#createTile(triangles.slice(tile * TILE_LENGTH, (tile + 1) * TILE_LENGTH)),
      ),
    );
    this.#draw(() => true);
  }

  /** Draw from now on the tiles that a camera sees of the mesh with this world matrix. Both are up to date. */
  cull({ projectionMatrix, matrixWorldInverse }: Camera, matrixWorld: Matrix4): void {
    toClip.multiplyMatrices(projectionMatrix, matrixWorldInverse).multiply(matrixWorld);
    frustum.setFromProjectionMatrix(toClip);
    this.#draw(({ bounds }) => frustum.intersectsSphere(bounds));
  }

  #draw(isVisible: (tile: Tile) => boolean): void {
    let end = 0;
    this.geometry.groups = this.#groups.map((tiles, materialIndex) => {
      const start = end;
      for (const { indices } of tiles.filter(isVisible)) {
        this.#index.array.set(indices, end);
        end += indices.length;
      }
      return { start, count: end - start, materialIndex };
    });
    this.#index.needsUpdate = true;
  }

  #createTile(triangles: readonly number[]): Tile {
    const { position } = this.geometry.attributes;
    const corners = triangles.map((corner) => new Vector3().fromBufferAttribute(position, corner));
    return { indices: orderTriangles(triangles), bounds: new Sphere().setFromPoints(corners) };
  }
}
