import { Vector3 } from "three";
import { expect, test } from "vitest";
import { PropMesh } from "../../../src/stage/props/prop-mesh";
import { ball } from "../../../src/stage/puppet/surface";

const FRONT = { colour: "#ff0000", roughness: 0.5, metalness: 1 };
const BACK = { colour: "#0000ff", roughness: 0.7, clearcoat: 0.3 };

const at = (x: number, y: number, z: number) => new Vector3(x, y, z);

test("a face with a back is seen from both sides", () => {
  const mesh = new PropMesh();
  mesh.addFace([at(0, 0, 0), at(1, 0, 0), at(1, 1, 0), at(0, 1, 0)], FRONT, BACK);
  expect(mesh.indices.length).toBe(12);
  expect(mesh.normals.slice(0, 3)).toEqual([0, 0, 1]);
  expect(mesh.normals.slice(12, 15)).toEqual([0, 0, -1]);
  expect(mesh.colours.slice(0, 3)).toEqual([1, 0, 0]);
  expect(mesh.colours.slice(12, 15)).toEqual([0, 0, 1]);
  expect(mesh.finishes.slice(0, 3)).toEqual([0.5, 1, 0]);
  expect(mesh.finishes.slice(12, 15)).toEqual([0.7, 0, 0.3]);
});

test("a face that ends in a point has no triangle without area", () => {
  const mesh = new PropMesh();
  mesh.addFace([at(0, 0, 0), at(1, 0, 0), at(1, 1, 0), at(1, 1, 0)], FRONT);
  expect(mesh.indices).toEqual([0, 1, 2]);
});

test("a rod and a solid face outwards", () => {
  const mesh = new PropMesh();
  mesh.addRod(at(0, 0, 0), at(0, 2, 0), at(1, 0, 0), 0.2, 0.1, FRONT);
  const rod = mesh.indices.length;
  expect(rod).toBe(36);
  mesh.addSolid(ball(at(0, 5, 0), 1), BACK);
  for (let corner = 0; corner < mesh.indices.length; corner += 3) {
    const [a, b, c] = mesh.indices
      .slice(corner, corner + 3)
      .map((index) => at(0, 0, 0).fromArray(mesh.positions, index * 3));
    const middle = at(0, corner < rod ? 1 : 5, 0);
    const face = b.clone().sub(a).cross(c.clone().sub(a));
    expect(face.dot(a.clone().add(b).add(c).divideScalar(3).sub(middle))).toBeGreaterThan(0);
  }
});
