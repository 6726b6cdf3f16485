import { describe, expect, test } from "vitest";
import { REQUIRED_BONES } from "../../src/avatar/bone-names";
import { AvatarError, fileTooLarge, MAX_FILE_BYTES } from "../../src/avatar/error";
import { parseAvatarFile } from "../../src/avatar/file";
import { SKELETONS } from "./skeletons";

/** A GLB of a description alone; `magic` and `version` as they should be. */
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

/** The description of a skeleton with something to see. */
function described(nodes = SKELETONS["Unreal"]): Record<string, unknown> {
  const json = nodes.map(({ name }, at) => ({
    name,
    children: nodes.flatMap(({ parent }, child) => (parent === at ? [child] : [])),
  }));
  return { asset: { version: "2.0" }, nodes: json, meshes: [{}] };
}

/** Why a file cannot be used. */
function why(bytes: ArrayBuffer): AvatarError {
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
  ...described(),
  extensions: { VRMC_vrm: { meta: { name: " Sato " }, humanoid: { humanBones: bones(list) } } },
});
const vrm0 = (list: readonly string[]) => ({
  ...described(),
  extensions: { VRM: { meta: { title: "Old" }, humanoid: { humanBones: list.map((bone, node) => ({ bone, node })) } } },
});

describe("what can dance", () => {
  test("a plain GLB by the names of its bones", () => {
    const { vrm, name, bones } = parseAvatarFile(glb(described()));
    expect([vrm, name, SKELETONS["Unreal"][bones.get("leftHand") ?? -1].name]).toEqual([false, null, "hand_l"]);
  });

  test("a VRM by the bones it names itself, of either version", () => {
    for (const [json, called] of [
      [vrm1(REQUIRED_BONES), "Sato"],
      [vrm0(REQUIRED_BONES), "Old"],
    ] as const) {
      const { vrm, name, bones } = parseAvatarFile(glb(json));
      expect([vrm, name, bones.get("leftHand")]).toEqual([true, called, REQUIRED_BONES.indexOf("leftHand")]);
    }
  });
});

describe("what cannot, and why", () => {
  test("what is no GLB, or of another version", () => {
    expect(why(new TextEncoder().encode('{"asset":{"version":"2.0"},"nodes":[]}').buffer).title).toBe("It is no GLB");
    expect(why(new ArrayBuffer(3)).title).toBe("It is no GLB");
    expect(why(glb(described(), { version: 1 })).detail).toContain("version 1");
  });

  test("what is cut off, or whose description is broken", () => {
    const whole = glb(described());
    for (const length of [12, 19, whole.byteLength - 1])
      expect(why(whole.slice(0, length)).detail).toContain("ends before");
    expect(why(glb(null, { text: '{"nodes": [' })).detail).toContain("cannot be read");
    const elsewhere = glb(described());
    new DataView(elsewhere).setUint32(12, 1e6, true);
    expect(why(elsewhere).detail).toContain("not where it should be");
  });

  test("what has no bones, or not all, of which those are named that are missing", () => {
    expect(why(glb({ nodes: [{ name: "Cube", mesh: 0 }], meshes: [{}] })).detail).toContain("no humanoid bones");
    expect(why(glb(vrm1(REQUIRED_BONES.filter((bone) => !bone.startsWith("leftLower"))))).detail).toContain(
      "left lower arm, left lower leg",
    );
    expect(why(glb(vrm0(REQUIRED_BONES.slice(1)))).detail).toContain("hips");
    const outside = vrm1(REQUIRED_BONES);
    outside.extensions.VRMC_vrm.humanoid.humanBones["head"] = { node: 999 };
    expect(why(glb(outside)).detail).toContain("head");
    for (const odd of [null, 7, [], { nodes: 3, extensions: { VRM: 1 } }])
      expect(why(glb(odd)).detail).toContain("no humanoid bones");
  });

  test("what has nothing to see, what lies in other files, what is compressed", () => {
    expect(why(glb({ ...described(), meshes: [] })).title).toBe("There is nothing to see");
    expect(why(glb({ ...described(), images: [{ uri: "https://example.org/skin.png" }] })).detail).toContain(
      "skin.png",
    );
    expect(parseAvatarFile(glb({ ...described(), images: [{ uri: "data:image/png;base64,AA==" }] })).vrm).toBe(false);
    expect(why(glb({ ...described(), extensionsRequired: ["KHR_draco_mesh_compression"] })).detail).toContain("Draco");
  });

  test("what is too large, with its size and the limit", () => {
    expect(fileTooLarge(MAX_FILE_BYTES + 1).detail).toBe("it has 101 MB, and 100 MB are the most");
    expect(why(new ArrayBuffer(MAX_FILE_BYTES + 1)).title).toBe("It is too large");
  });
});
