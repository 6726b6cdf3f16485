/** Builder of a prop's mesh: solids, and flat faces of paper and petals. */
import { Color, Vector3 } from "three";
import type { PropShape } from "../../motion/prop-model";
import type { Finish } from "../puppet/finish";
import { orientOutward } from "../puppet/geometry-builder";
import type { Surface } from "../puppet/surface";

/** Shape that is built of solids and faces. */
export class PropMesh implements PropShape {
  readonly positions: number[] = [];
  readonly normals: number[] = [];
  readonly colours: number[] = [];
  readonly finishes: number[] = [];
  readonly indices: number[] = [];

  /** Add a closed surface. */
  addSolid(surface: Surface, finish: Finish): void {
    const mesh = surface("full");
    orientOutward(mesh, false);
    const first = this.positions.length / 3;
    for (let at = 0; at < mesh.positions.length; at += 3)
      this.#addVertex(
        new Vector3().fromArray(mesh.positions, at),
        new Vector3().fromArray(mesh.normals, at).normalize(),
        finish,
      );
    this.#addTriangles(mesh.indices.map((index) => index + first));
  }

  /**
   * Add a flat convex face, seen from the side on which its corners are counter-clockwise. With `back`, it is seen from
   * the other side too, in that finish. `normals` are those of the corners; by default all are that of the face.
   */
  addFace(corners: readonly Vector3[], finish: Finish, back?: Finish, normals?: readonly Vector3[]): void {
    const first = this.positions.length / 3;
    const normal = faceNormal(corners);
    corners.forEach((corner, at) => this.#addVertex(corner, normals?.[at] ?? normal, finish));
    this.#addTriangles(corners.slice(2).flatMap((_, at) => [first, first + at + 1, first + at + 2]));
    if (back)
      this.addFace(
        corners.toReversed(),
        back,
        undefined,
        normals?.toReversed().map((one) => one.clone().negate()),
      );
  }

  /** Add a rod with a square section from one point to another, whose sides are along `across`. */
  addRod(from: Vector3, to: Vector3, across: Vector3, width: number, thickness: number, finish: Finish): void {
    const along = to.clone().sub(from).normalize();
    const side = across.clone().addScaledVector(along, -across.dot(along)).normalize();
    const up = along.clone().cross(side).normalize();
    const section = [
      [-1, -1],
      [1, -1],
      [1, 1],
      [-1, 1],
    ].map(([s, u]) =>
      side
        .clone()
        .multiplyScalar((s * width) / 2)
        .addScaledVector(up, (u * thickness) / 2),
    );
    const [start, end] = [from, to].map((at) => section.map((corner) => corner.clone().add(at)));
    // The section is counter-clockwise as seen against the direction of the rod.
    for (let at = 0; at < 4; at++) {
      const next = (at + 1) % 4;
      this.addFace([start[at], start[next], end[next], end[at]], finish);
    }
    this.addFace(start.toReversed(), finish);
    this.addFace(end, finish);
  }

  #addVertex(position: Vector3, normal: Vector3, { colour, roughness, metalness = 0, clearcoat = 0 }: Finish): void {
    const { r, g, b } = new Color(colour);
    this.positions.push(position.x, position.y, position.z);
    this.normals.push(normal.x, normal.y, normal.z);
    this.colours.push(r, g, b);
    this.finishes.push(roughness, metalness, clearcoat);
  }

  /** Add triangles without those whose corners coincide: poles of surfaces, and faces that end in a point. */
  #addTriangles(indices: readonly number[]): void {
    const place = (index: number) => new Vector3().fromArray(this.positions, index * 3);
    for (let at = 0; at < indices.length; at += 3) {
      const [a, b, c] = indices.slice(at, at + 3).map(place);
      if (b.sub(a).cross(c.sub(a)).length() > MIN_DOUBLE_AREA) this.indices.push(...indices.slice(at, at + 3));
    }
  }
}

/** Twice the area of the smallest triangle, in square metres. */
const MIN_DOUBLE_AREA = 1e-9;

/** Return the unit normal of a flat face (Newell's method). */
function faceNormal(corners: readonly Vector3[]): Vector3 {
  const normal = new Vector3();
  corners.forEach((corner, at) => normal.add(corner.clone().cross(corners[(at + 1) % corners.length])));
  return normal.normalize();
}
