/** Builder that joins the puppet's parts into one skinned geometry. */
import { BufferGeometry, Color, Float32BufferAttribute, Uint16BufferAttribute, Vector3 } from "three";
import { orderTriangles } from "../rendering/triangle-order";
import { type Finish, MATERIAL_PARTS, PATTERN } from "./finish";
import { HEAD_CENTRE } from "./standard-figure";
import type { Detail, Surface, SurfaceMesh } from "./surface";

/** Bones of a vertex by its position on the standard figure. Weights need not sum to one. */
export type VertexWeights = (at: Vector3) => readonly (readonly [bone: string, weight: number])[];

/** Moves a vertex and its normal from the standard figure to the performer's, given its bones. */
export type FitVertex = (position: Vector3, normal: Vector3, weights: readonly (readonly [string, number])[]) => void;

/** Size of the planar projection of the face paint in metres, and the enlargement of the head about the chin. */
export const FACE_WINDOW_M = [0.2, 0.26] as const;
const HEAD_SCALE = 1.07;
const CHIN_OFFSET_M = 0.11;

export class GeometryBuilder {
  readonly #bones: ReadonlyMap<string, number>;
  readonly #fit: FitVertex;
  readonly #detail: Detail;
  readonly #positions: number[] = [];
  readonly #normals: number[] = [];
  readonly #colours: number[] = [];
  readonly #finishes: number[] = [];
  readonly #patterns: number[] = [];
  readonly #skinIndices: number[] = [];
  readonly #skinWeights: number[] = [];
  /** Triangles by the index of their material in software rendering. */
  readonly #indices: readonly number[][] = MATERIAL_PARTS.map(() => []);

  constructor(bones: readonly string[], fit: FitVertex, detail: Detail) {
    this.#bones = new Map(bones.map((name, index) => [name, index]));
    this.#fit = fit;
    this.#detail = detail;
  }

  /** Add a part on one bone, or on several by weights. `facesInward` turns a lining's faces to the inside. */
  add(surface: Surface, bones: string | VertexWeights, finish: Finish, facesInward = false): void {
    const mesh = surface(this.#detail);
    orientOutward(mesh, facesInward);
    const first = this.#positions.length / 3;
    const colour = new Color(finish.colour);
    const pattern = finish.pattern ?? PATTERN.plain;
    const position = new Vector3();
    const normal = new Vector3();
    const weightsAt: VertexWeights =
      typeof bones === "string" ? rigidWeights(bones) : (at) => normaliseWeights(bones(at));
    for (let i = 0; i < mesh.positions.length / 3; i++) {
      position.fromArray(mesh.positions, i * 3);
      normal.fromArray(mesh.normals, i * 3);
      const weights = weightsAt(position);
      if (pattern === PATTERN.face) {
        const y = (position.y - HEAD_CENTRE.y + CHIN_OFFSET_M) / HEAD_SCALE - CHIN_OFFSET_M;
        this.#patterns.push(
          (position.x - HEAD_CENTRE.x) / HEAD_SCALE / FACE_WINDOW_M[0] + 0.5,
          y / FACE_WINDOW_M[1] + 0.5,
          pattern,
        );
      } else {
        this.#patterns.push(mesh.uvs[i * 2], mesh.uvs[i * 2 + 1], pattern);
      }
      this.#fit(position, normal, weights);
      this.#positions.push(position.x, position.y, position.z);
      this.#normals.push(normal.x, normal.y, normal.z);
      this.#colours.push(colour.r, colour.g, colour.b);
      this.#finishes.push(finish.roughness, finish.metalness ?? 0, finish.clearcoat ?? 0, finish.wood ?? 0);
      for (let k = 0; k < 4; k++) {
        const bone = weights[k];
        this.#skinIndices.push(bone ? this.#boneIndex(bone[0]) : 0);
        this.#skinWeights.push(bone ? bone[1] : 0);
      }
    }
    const part = MATERIAL_PARTS.indexOf(pattern === PATTERN.face ? "face" : "faceless");
    for (const index of mesh.indices) this.#indices[part].push(index + first);
  }

  /**
   * Return the geometry of all parts, with attributes `finish` (roughness, metalness, clearcoat, wood) and `pattern`
   * (u, v, kind). Its groups are those of `MATERIAL_PARTS`.
   */
  build(): BufferGeometry {
    const geometry = new BufferGeometry();
    geometry.setAttribute("position", new Float32BufferAttribute(this.#positions, 3));
    geometry.setAttribute("normal", new Float32BufferAttribute(this.#normals, 3));
    geometry.setAttribute("color", new Float32BufferAttribute(this.#colours, 3));
    geometry.setAttribute("finish", new Float32BufferAttribute(this.#finishes, 4));
    geometry.setAttribute("pattern", new Float32BufferAttribute(this.#patterns, 3));
    geometry.setAttribute("skinIndex", new Uint16BufferAttribute(this.#skinIndices, 4));
    geometry.setAttribute("skinWeight", new Float32BufferAttribute(this.#skinWeights, 4));
    // The coarse detail is that of software rendering.
    const indices = this.#detail === "coarse" ? this.#indices.map(orderTriangles) : this.#indices;
    geometry.setIndex(indices.flat());
    let start = 0;
    this.#indices.forEach(({ length }, part) => {
      geometry.addGroup(start, length, part);
      start += length;
    });
    return geometry;
  }

  #boneIndex(bone: string): number {
    const index = this.#bones.get(bone);
    if (index === undefined) throw new Error(`The puppet has no bone "${bone}".`);
    return index;
  }
}

function rigidWeights(bone: string): VertexWeights {
  const all = [[bone, 1] as const];
  return () => all;
}

function normaliseWeights(weights: readonly (readonly [string, number])[]): (readonly [string, number])[] {
  const kept = weights.filter(([, weight]) => weight > 1e-4).slice(0, 4);
  const sum = kept.reduce((total, [, weight]) => total + weight, 0);
  return kept.map(([bone, weight]) => [bone, weight / sum] as const);
}

/** Wind triangles outwards (by signed volume about the centroid) and make the normals agree. */
export function orientOutward({ positions, normals, indices }: SurfaceMesh, facesInward: boolean): void {
  const centre = new Vector3();
  for (let i = 0; i < positions.length; i += 3) centre.add(new Vector3().fromArray(positions, i));
  centre.divideScalar(positions.length / 3);
  const [a, b, c, n] = [new Vector3(), new Vector3(), new Vector3(), new Vector3()];
  let volume = 0;
  let agreement = 0;
  for (let i = 0; i < indices.length; i += 3) {
    a.fromArray(positions, indices[i] * 3).sub(centre);
    b.fromArray(positions, indices[i + 1] * 3).sub(centre);
    c.fromArray(positions, indices[i + 2] * 3).sub(centre);
    const face = b.sub(a).cross(c.sub(a));
    volume += a.dot(face);
    agreement += face.dot(n.fromArray(normals, indices[i] * 3));
  }
  const flip = volume > 0 === facesInward;
  if (flip) for (let i = 0; i < indices.length; i += 3) [indices[i], indices[i + 1]] = [indices[i + 1], indices[i]];
  if (agreement > 0 === flip) for (let i = 0; i < normals.length; i++) normals[i] = -normals[i];
}
