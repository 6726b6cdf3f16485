import { expect, test } from "vitest";
import { isAvatarFile } from "../../../src/ui/library/avatar-chooser";

test("figures are told from dances by their endings, however these are written", () => {
  const named = (name: string) => isAvatarFile(new File([], name));
  expect(["sato.vrm", "Sato.GLB", "scene.gltf"].map(named)).toEqual([true, true, true]);
  expect(["dance.bvh", "glb", "my.vrm.zip", "take.fbx"].map(named)).toEqual([false, false, false, false]);
});
