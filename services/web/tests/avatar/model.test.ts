import { Mesh, type Object3D } from "three";
import { describe, expect, test } from "vitest";
import { AvatarError } from "../../src/avatar/error";
import { AvatarModel } from "../../src/avatar/model";
import { compressByMeshopt, readFile } from "./compressed-files";
import { createFigureFile } from "./figure-files";
import { container } from "./glb-container";

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

  test("compressed by meshopt has the bones and vertices of the original", async () => {
    const original = createFigureFile({ vrm: 1 });
    const compressed = await compressByMeshopt(original);
    expect(compressed.length).toBeLessThan(original.length);
    const [a, b] = await Promise.all([original, compressed].map((file) => AvatarModel.parse(file.buffer, "mine")));
    expect(b.rest.soleHeight).toBeCloseTo(a.rest.soleHeight, 3);
    for (const [bone, { position }] of a.rest.bones)
      expect(b.rest.bones.get(bone)?.position.distanceTo(position)).toBeLessThan(1e-6);
    for (const [hand, length] of a.rest.handLengths) expect(b.rest.handLengths.get(hand)).toBeCloseTo(length, 3);
  });

  test("with damaged compressed data is rejected", async () => {
    const compressed = await compressByMeshopt(createFigureFile());
    const { json, view } = readFile(compressed);
    const bytes = Uint8Array.from({ length: Number(json.buffers[0].byteLength) }, (_, at) => (at * 37) & 255);
    expect(view(0).length).toBeGreaterThan(0);
    await expect(AvatarModel.parse(container(json, bytes).buffer, "mine")).rejects.toMatchObject({
      name: "AvatarError",
      title: "File damaged",
    });
  });

  test("whose vertices are nowhere is rejected", async () => {
    const file = createFigureFile();
    const { json } = readFile(file);
    new DataView(file.buffer).setFloat32(file.length - Number(json.buffers[0].byteLength) + 12, NaN, true);
    await expect(AvatarModel.parse(file.buffer, "mine")).rejects.toThrow(/POSITION\[1\] is not finite/);
  });

  test("whose triangles refer to missing vertices is rejected", async () => {
    const file = createFigureFile();
    const { json } = readFile(file);
    const { byteOffset = 0 } = json.bufferViews[4];
    const start = file.length - Number(json.buffers[0].byteLength);
    new DataView(file.buffer).setUint16(start + byteOffset, 65_535, true);
    await expect(AvatarModel.parse(file.buffer, "mine")).rejects.toThrow(/indices\[0\]/);
  });

  test("whose limbs are no body's is rejected", async () => {
    await expect(AvatarModel.parse(createFigureFile({ forearm: 100 }).buffer, "mine")).rejects.toThrow(
      /LowerArm and leftHand are too far apart/,
    );
  });

  test("whose limbs have no length is rejected", async () => {
    await expect(AvatarModel.parse(createFigureFile({ forearm: 0 }).buffer, "mine")).rejects.toThrow(
      /leftLowerArm and leftHand are at the same position/,
    );
  });
});
