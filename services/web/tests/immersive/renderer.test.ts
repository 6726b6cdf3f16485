import { ArrayCamera, Group, Matrix4, PerspectiveCamera, Scene, Vector3, type WebGLRenderer } from "three";
import { expect, test } from "vitest";
import { drawFrame } from "../../src/immersive/renderer";

test("a giant's eyes are as far apart as those of a giant, and measure in the scene's metres", () => {
  const [scene, room, camera] = [new Scene(), new Group(), new PerspectiveCamera()];
  room.matrixAutoUpdate = false;
  room.matrix
    .makeRotationY(0.3)
    .scale(new Vector3(4, 4, 4))
    .setPosition(1, 2, 3);
  scene.add(room.add(camera));
  scene.updateMatrixWorld();
  const places = [new Vector3(-0.03, 1.6, 0), new Vector3(0.03, 1.6, 0)];
  const eyes = places.map(() => new PerspectiveCamera());
  const both = new ArrayCamera(eyes);
  const drawn: unknown[] = [];
  drawFrame(
    {
      xr: {
        getCamera: () => both,
        // As three.js does.
        updateCamera: ({ parent }: PerspectiveCamera) => {
          [both, ...eyes].forEach((eye, nth) => {
            const pose = new Matrix4().setPosition(places[Math.max(nth - 1, 0)]);
            eye.matrixWorld.multiplyMatrices((parent as Group).matrixWorld, pose);
          });
        },
      },
      render: (...parts: unknown[]) => drawn.push(...parts),
    } as unknown as WebGLRenderer,
    scene,
    camera,
  );
  expect(drawn).toEqual([scene, camera]);
  const [left, right] = eyes.map(({ matrixWorld }) => new Vector3().setFromMatrixPosition(matrixWorld));
  expect(left.distanceTo(right)).toBeCloseTo(0.24);
  for (const { matrixWorld, matrixWorldInverse } of [both, ...eyes]) {
    expect(matrixWorld.determinant()).toBeCloseTo(1);
    const identity = matrixWorldInverse.clone().multiply(matrixWorld).elements;
    identity.forEach((value, at) => expect(value).toBeCloseTo(at % 5 === 0 ? 1 : 0));
  }
});
