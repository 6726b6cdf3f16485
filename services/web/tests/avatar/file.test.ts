import { describe, expect, test } from "vitest";
import { REQUIRED_BONES } from "../../src/avatar/bone-names";
import { AvatarError, fileTooLarge, MAX_FILE_BYTES } from "../../src/avatar/error";
import { parseAvatarFile } from "../../src/avatar/file";
import { SKELETONS } from "./skeletons";

/** Create a GLB file with only a JSON chunk. */
function glb(json: unknown, { magic = "glTF", version = 2, text = JSON.stringify(json) } = {}): ArrayBuffer {
  const body = new TextEncoder().encode(text);
  const bytes = new ArrayBuffer(20 + body.length);
  const view = new DataView(bytes);
  new Uint8Array(bytes).set(new TextEncoder().encode(magic));
  view.setUint32(4, version, true);
  view.setUint32(8, bytes.byteLength, true);
  view.setUint32(12, body.length, true);
  view.setUint32(16, 0x4e4f534a, true);
  new Uint8Array(bytes).set(body, 20);
  return bytes;
}

/** Return the description of a skeleton with a mesh. */
function createDescription(nodes = SKELETONS["Unreal"]): Record<string, unknown> {
  const json = nodes.map(({ name }, at) => ({
    name,
    children: nodes.flatMap(({ parent }, child) => (parent === at ? [child] : [])),
  }));
  return { asset: { version: "2.0" }, nodes: json, meshes: [{}] };
}

/** Return the error for an unusable file. */
function errorOf(bytes: ArrayBuffer): AvatarError {
  try {
    parseAvatarFile(bytes);
  } catch (error) {
    if (error instanceof AvatarError) return error;
    throw error;
  }
  throw new Error("it was taken");
}

const bones = (list: readonly string[]) => Object.fromEntries(list.map((bone, node) => [bone, { node }]));
const vrm1 = (list: readonly string[]) => ({
  ...createDescription(),
  extensions: { VRMC_vrm: { meta: { name: " Sato " }, humanoid: { humanBones: bones(list) } } },
});
const vrm0 = (list: readonly string[]) => ({
  ...createDescription(),
  extensions: { VRM: { meta: { title: "Old" }, humanoid: { humanBones: list.map((bone, node) => ({ bone, node })) } } },
});

describe("usable files", () => {
  test("are plain GLB files, by the names of their bones", () => {
    const { vrm, name, bones } = parseAvatarFile(glb(createDescription()));
    expect([vrm, name, SKELETONS["Unreal"][bones.get("leftHand") ?? -1].name]).toEqual([false, null, "hand_l"]);
  });

  test("are VRM files of both versions, by their declared bones", () => {
    for (const [json, called] of [
      [vrm1(REQUIRED_BONES), "Sato"],
      [vrm0(REQUIRED_BONES), "Old"],
    ] as const) {
      const { vrm, name, bones } = parseAvatarFile(glb(json));
      expect([vrm, name, bones.get("leftHand")]).toEqual([true, called, REQUIRED_BONES.indexOf("leftHand")]);
    }
  });
});

describe("unusable files", () => {
  test("are other formats or versions of glTF", () => {
    expect(errorOf(new TextEncoder().encode('{"asset":{"version":"2.0"},"nodes":[]}').buffer).title).toBe(
      "Not a GLB file",
    );
    expect(errorOf(new ArrayBuffer(3)).title).toBe("Not a GLB file");
    expect(errorOf(glb(createDescription(), { version: 1 })).detail).toContain("version 1");
  });

  test("are truncated or have a broken description", () => {
    const whole = glb(createDescription());
    for (const length of [12, 19, whole.byteLength - 1])
      expect(errorOf(whole.slice(0, length)).detail).toContain("truncated");
    expect(errorOf(glb(null, { text: '{"nodes": [' })).detail).toContain("cannot be parsed");
    const elsewhere = glb(createDescription());
    new DataView(elsewhere).setUint32(12, 1e6, true);
    expect(errorOf(elsewhere).detail).toContain("missing or too long");
  });

  test("lack bones, and the missing ones are named", () => {
    expect(errorOf(glb({ nodes: [{ name: "Cube", mesh: 0 }], meshes: [{}] })).detail).toContain("no humanoid bones");
    expect(errorOf(glb(vrm1(REQUIRED_BONES.filter((bone) => !bone.startsWith("leftLower"))))).detail).toContain(
      "left lower arm, left lower leg",
    );
    expect(errorOf(glb(vrm0(REQUIRED_BONES.slice(1)))).detail).toContain("hips");
    const outside = vrm1(REQUIRED_BONES);
    outside.extensions.VRMC_vrm.humanoid.humanBones["head"] = { node: 999 };
    expect(errorOf(glb(outside)).detail).toContain("head");
    for (const odd of [null, 7, [], { nodes: 3, extensions: { VRM: 1 } }])
      expect(errorOf(glb(odd)).detail).toContain("no humanoid bones");
  });

  test("have no mesh, external files or an unsupported compression", () => {
    expect(errorOf(glb({ ...createDescription(), meshes: [] })).title).toBe("Nothing to draw");
    expect(
      errorOf(glb({ ...createDescription(), images: [{ uri: "https://example.org/skin.png" }] })).detail,
    ).toContain("skin.png");
    expect(parseAvatarFile(glb({ ...createDescription(), images: [{ uri: "data:image/png;base64,AA==" }] })).vrm).toBe(
      false,
    );
    expect(
      errorOf(glb({ ...createDescription(), extensionsRequired: ["KHR_draco_mesh_compression"] })).detail,
    ).toContain("Draco");
  });

  test("are too large, with the size and the limit", () => {
    expect(fileTooLarge(MAX_FILE_BYTES + 1).detail).toBe("101 MB; the limit is 100 MB");
    expect(errorOf(new ArrayBuffer(MAX_FILE_BYTES + 1)).title).toBe("File too large");
  });
});
