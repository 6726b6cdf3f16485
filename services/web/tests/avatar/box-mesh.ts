/** Boxes around line segments, as lists of vertices and indices. */
import { Quaternion, type Vector3 } from "three";
import { at } from "./figure-bones";

/** Add a box around the segment between two points; with `floor` it extends down to that height. */
export function addBox(
  from: Vector3,
  to: Vector3,
  thickness: number,
  positions: number[],
  normals: number[],
  indices: number[],
  floor: number | null,
): void {
  const along = to.clone().sub(from);
  const turn = new Quaternion().setFromUnitVectors(at(0, 1, 0), along.clone().normalize());
  for (const axis of [0, 1, 2]) {
    for (const sign of [1, -1]) {
      const first = positions.length / 3;
      const normal = at(0, 0, 0).setComponent(axis, sign);
      for (const [u, v] of [
        [-1, -1],
        [1, -1],
        [1, 1],
        [-1, 1],
      ]) {
        const corner = at(0, 0, 0)
          .setComponent(axis, sign)
          .setComponent((axis + 1) % 3, sign * u)
          .setComponent((axis + 2) % 3, v);
        const place = at(corner.x * thickness, ((corner.y + 1) / 2) * along.length(), corner.z * thickness)
          .applyQuaternion(turn)
          .add(from);
        if (floor !== null && place.y < (from.y + floor) / 2) place.y = floor;
        positions.push(...place.toArray());
        normals.push(...normal.clone().applyQuaternion(turn).toArray());
      }
      indices.push(first, first + 1, first + 2, first, first + 2, first + 3);
    }
  }
}
