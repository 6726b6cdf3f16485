import { expect, test } from "vitest";
import { findFileKind } from "../../src/app/file-kind";

/** Return a GLB file with this JSON part. */
function glb(json: string, length = json.length): File {
  const header = new DataView(new ArrayBuffer(20));
  header.setUint32(12, length, true);
  return new File([header, json], "Dancer.GLB");
}

test.for([
  [new File([], "walk.bvh"), "motion"],
  [new File([], "walk.FBX"), "motion"],
  [new File([], "walk.vrma"), "motion"],
  [new File([], "clips.zip"), "motion"],
  [new File([], "walk.vrm.bvh"), "motion"],
  [new File([], "aiko.VRM"), "avatar"],
  [glb('{"animations": [{}], "meshes": [{}]}'), "motion"],
  [glb('{"animations": [{}], "skins": [{}]}'), "motion"],
  [glb('{"animations": [], "skins": [{}]}'), "avatar"],
  [glb('{"extensions": {"VRMC_vrm": {}}}'), "avatar"],
  [glb('{"extensions": {"VRM": {}}}'), "avatar"],
  [glb('{"animations": [], "skins": [], "meshes": [{}]}'), "prop"],
  [glb('{"extensions": {"KHR_xmp_json_ld": {}}}'), "prop"],
  [glb("{}"), "prop"],
  [glb("null"), "avatar"],
  [glb("{", 1 << 30), "avatar"],
  [glb("{broken"), "avatar"],
  [new File(["x"], "short.glb"), "avatar"],
  [new File(['{"animations": [{}]}'], "walk.gltf"), "motion"],
  [new File(["{}"], "sword.gltf"), "prop"],
] as const)("file %# is taken as what it is", async ([file, kind]) => {
  expect(await findFileKind(file)).toBe(kind);
});
