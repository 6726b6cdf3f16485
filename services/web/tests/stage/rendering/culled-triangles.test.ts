import { type BufferAttribute, Matrix4, PerspectiveCamera, PlaneGeometry, Vector3 } from "three";
import { expect, test } from "vitest";
import { CulledTriangles } from "../../../src/stage/rendering/culled-triangles";

/** Return the triangles that `geometry` draws, by group, in an order that does not depend on theirs. */
function drawnTriangles({ index, groups }: PlaneGeometry): string[][] {
  return groups.map(({ start, count }) =>
    Array.from({ length: count / 3 }, (_, at) => index!.array.slice(start + 3 * at, start + 3 * at + 3).join()).sort(),
  );
}

/** Return a camera at (x, 0, z) that looks along -z and sees half as far to the sides as ahead. */
function createCamera(x: number, z: number): PerspectiveCamera {
  const camera = new PerspectiveCamera((2 * Math.atan(0.5) * 180) / Math.PI, 1, 0.1, 100);
  camera.position.set(x, 0, z);
  camera.updateMatrixWorld();
  return camera;
}

test("all triangles are drawn until a camera is given", () => {
  const geometry = new PlaneGeometry(8, 8, 16, 16);
  const all = drawnTriangles({ ...geometry, groups: [{ start: 0, count: 16 * 16 * 6 }] } as PlaneGeometry);
  new CulledTriangles(geometry);
  expect(drawnTriangles(geometry)).toEqual(all);
});

test("triangles with a corner in view are drawn, and most others are not", () => {
  const geometry = new PlaneGeometry(8, 8, 32, 32);
  const triangles = new CulledTriangles(geometry);
  const [all] = drawnTriangles(geometry);
  const position = geometry.attributes["position"] as BufferAttribute;
  for (const x of [-3, 0, 2.5]) {
    const [camera, matrixWorld] = [createCamera(x, 2), new Matrix4().makeTranslation(0.3, 0.2, -1)];
    triangles.cull(camera, matrixWorld);
    const [drawn] = drawnTriangles(geometry);
    const isInView = (corner: string) => {
      const at = new Vector3().fromBufferAttribute(position, Number(corner)).applyMatrix4(matrixWorld).project(camera);
      return Math.abs(at.x) < 1 && Math.abs(at.y) < 1;
    };
    const inView = all.filter((triangle) => triangle.split(",").some(isInView));
    expect(inView.length).toBeGreaterThan(50);
    expect(drawn).toEqual(expect.arrayContaining(inView));
    expect(drawn.length).toBeLessThan(0.6 * all.length);
  }
});

test("groups keep their triangles and materials when they are culled, and come back", () => {
  const geometry = new PlaneGeometry(8, 8, 16, 16);
  const array = Array.from(geometry.index!.array);
  const triangles = new CulledTriangles(geometry);
  triangles.triangles = [array.slice(0, 960), array.slice(960)];
  const all = drawnTriangles(geometry);
  expect(all.map(({ length }) => length)).toEqual([320, 192]);
  triangles.cull(createCamera(100, 2), new Matrix4());
  expect(drawnTriangles(geometry)).toEqual([[], []]);
  triangles.cull(createCamera(0, 50), new Matrix4());
  expect(drawnTriangles(geometry)).toEqual(all);
  expect(geometry.groups.map(({ materialIndex }) => materialIndex)).toEqual([0, 1]);
});
