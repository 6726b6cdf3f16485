import { Bone, Group, Matrix4, PerspectiveCamera, Skeleton, Texture, Vector4 } from "three";
import { expect, test } from "vitest";
import { BONES, FACE_BONE } from "../../../src/stage/puppet/bones";
import { SimpleFigureMaterial } from "../../../src/stage/puppet/simple-material";

test("bones are rows of matrices into the view, and the face's are columns of its movements", () => {
  const bones = BONES.map(() => new Bone());
  const skeleton = new Skeleton(bones);
  const moved = bones[3];
  moved.position.set(0.3, 1.2, -0.4);
  moved.rotation.set(0.5, -0.8, 1.1);
  new Group().add(...bones).updateMatrixWorld(true);
  const face = bones[BONES.indexOf(FACE_BONE)];
  face.matrixWorld.set(1, 5, 9, 13, 2, 6, 10, 14, 3, 7, 11, 15, 4, 8, 12, 16);
  skeleton.update();
  const camera = new PerspectiveCamera();
  camera.position.set(1, 2, 6);
  camera.lookAt(0, 1, 0);
  camera.updateMatrixWorld();
  const material = new SimpleFigureMaterial({ face: new Texture(), asanoha: new Texture() }, "face");
  const table = new Texture();
  material.prepare(skeleton, table, camera);
  const { bones: rows, movements, lightTable } = material.uniforms;
  const expected = new Matrix4().multiplyMatrices(camera.matrixWorldInverse, moved.matrixWorld);
  const at = new Vector4(0.2, 0.5, 0.7, 1);
  const seen = at.clone().applyMatrix4(expected);
  for (let row = 0; row < 3; row++)
    expect(new Vector4().fromArray(rows.value, 4 * (3 * 3 + row)).dot(at)).toBeCloseTo(seen.getComponent(row), 5);
  expect(movements.value.map((column: Vector4) => column.toArray())).toEqual([
    [1, 2, 3, 4],
    [5, 6, 7, 8],
    [9, 10, 11, 12],
    [13, 14, 15, 16],
  ]);
  expect(lightTable.value).toBe(table);
});

test("colours are displayed as sRGB, within one percent", () => {
  const { fragmentShader } = new SimpleFigureMaterial({ face: new Texture(), asanoha: new Texture() }, "face");
  const [, root, fourthRoot, linear] = (
    /= ([\d.]+) \* root - ([\d.]+) \* sqrt\(root\) - ([\d.]+) \* gl_FragColor/.exec(fragmentShader) ?? []
  ).map(Number);
  for (let share = 0; share <= 1; share += 1 / 256) {
    const shown = share <= 0.0031308 ? 12.92 * share : 1.055 * share ** (1 / 2.4) - 0.055;
    expect(Math.abs(root * share ** 0.5 - fourthRoot * share ** 0.25 - linear * share - shown)).toBeLessThan(0.01);
  }
});
