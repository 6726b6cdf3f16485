import { expect, test } from "vitest";
import { isAvatarFile } from "../../../src/ui/library/avatar-chooser";

test("avatar files are recognised by extension, ignoring case", () => {
  const isAvatar = (name: string) => isAvatarFile(new File([], name));
  expect(["sato.vrm", "Sato.GLB", "scene.gltf"].map(isAvatar)).toEqual([true, true, true]);
  expect(["dance.bvh", "glb", "my.vrm.zip", "take.fbx"].map(isAvatar)).toEqual([false, false, false, false]);
});
