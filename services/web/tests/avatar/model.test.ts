import { Mesh, type Object3D } from "three";
import { describe, expect, test } from "vitest";
import { AvatarError } from "../../src/avatar/error";
import { AvatarModel } from "../../src/avatar/model";
import { createFigureFile } from "./figure-files";

describe("a parsed model", () => {
  test("has the author's name or the file's, and a node per bone", async () => {
    const [vrm, old, plain] = await Promise.all(
      [{ vrm: 1 }, { vrm: 0 }, {}].map((options) =>
        AvatarModel.parse(createFigureFile(options as { vrm?: 0 | 1 }).buffer, "mine"),
      ),
    );
    expect([vrm.name, old.name, plain.name]).toEqual(["Boxes", "Old boxes", "mine"]);
    expect([vrm.vrm !== null, old.vrm !== null, plain.vrm]).toEqual([true, true, null]);
    for (const model of [vrm, old, plain]) expect(model.nodes.get("leftHand")?.name).toBe("leftHand");
  });

  test("casts and receives shadows and is never culled", async () => {
    const { root: stand } = await AvatarModel.parse(createFigureFile().buffer, "mine");
    const meshes: Object3D[] = [];
    stand.traverse((object) => object instanceof Mesh && meshes.push(object));
    expect(
      meshes.map(({ castShadow, receiveShadow, frustumCulled }) => [castShadow, receiveShadow, frustumCulled]),
    ).toEqual([[true, true, false]]);
  });

  test("with unreadable meshes is rejected as broken", async () => {
    const whole = createFigureFile();
    const view = new DataView(whole.buffer);
    // The description is intact, but its binary chunk is missing.
    const end = 20 + view.getUint32(12, true);
    const cut = whole.slice(0, end);
    new DataView(cut.buffer).setUint32(8, end, true);
    await expect(AvatarModel.parse(cut.buffer, "mine")).rejects.toMatchObject({
      name: "AvatarError",
      title: "File damaged",
    });
    await expect(AvatarModel.parse(new ArrayBuffer(8), "mine")).rejects.toBeInstanceOf(AvatarError);
  });

  test("whose limbs have no length is rejected", async () => {
    await expect(AvatarModel.parse(createFigureFile({ forearm: 0 }).buffer, "mine")).rejects.toThrow(
      /leftLowerArm and leftHand are at the same position/,
    );
  });
});
