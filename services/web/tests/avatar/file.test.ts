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
  return {
    asset: { version: "2.0" },
    nodes: json,
    meshes: [{ primitives: [{ attributes: { POSITION: 0 } }] }],
    accessors: [{ componentType: 5126, count: 3, type: "VEC3" }],
  };
}

/** Return the description of things that are no body. */
function createThings(...names: string[]): Record<string, unknown> {
  const { asset, meshes, accessors } = createDescription();
  return { asset, meshes, accessors, nodes: names.map((name) => ({ name, mesh: 0 })) };
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

test("an author's name that is none is not used", () => {
  const named = (name: unknown) => {
    const json = vrm1(REQUIRED_BONES);
    Object.assign(json.extensions.VRMC_vrm.meta, { name });
    return parseAvatarFile(glb(json)).name;
  };
  expect(["undefined", " null ", "\u0000\u0007", "", 7, undefined, "Sa\nto"].map(named)).toEqual([
    null,
    null,
    null,
    null,
    null,
    null,
    "Sa to",
  ]);
});

describe("unusable files", () => {
  test("are other formats or versions of glTF", () => {
    expect(errorOf(new TextEncoder().encode('{"asset":{"version":"2.0"},"nodes":[]}').buffer).title).toBe(
      "Not a GLB file",
    );
    expect(errorOf(new ArrayBuffer(3)).title).toBe("Not a GLB file");
    expect(errorOf(glb(createDescription(), { version: 1 })).detail).toContain("version 1");
  });

  test("lack bones, and the missing ones are named", () => {
    expect(errorOf(glb(vrm1(REQUIRED_BONES.filter((bone) => !bone.startsWith("leftLower"))))).detail).toContain(
      "left lower arm, left lower leg",
    );
    expect(errorOf(glb(vrm0(REQUIRED_BONES.slice(1)))).detail).toContain("hips");
    const outside = vrm1(REQUIRED_BONES);
    outside.extensions.VRMC_vrm.humanoid.humanBones["head"] = { node: 999 };
    expect(errorOf(glb(outside)).detail).toContain("head");
    const armless = SKELETONS["Mixamo"].map((node) => ({ ...node, name: node.name.replace("LeftForeArm", "x") }));
    expect(errorOf(glb(createDescription(armless))).detail).toBe("missing bones: left lower arm");
  });

  test.each([["Helmet"], ["Left wheel", "Right wheel", "Body", "Hood"], ["Sphere"], [""]])(
    "are no body: %s",
    (...names) => {
      const { title, detail, hint } = errorOf(glb(createThings(...names)));
      expect(title).toBe("No usable humanoid");
      expect(detail).toContain("no body found; meshes: 1, joints: 0");
      expect(detail).toContain(names[0]);
      expect(hint).toContain("two arms, two legs and a head");
    },
  );

  test("have another description than that of glTF", () => {
    for (const odd of [null, 7, [], { nodes: 3, extensions: { VRM: 1 } }, { asset: { version: 2 } }])
      expect(errorOf(glb(odd)).detail).toContain("asset.version");
    expect(errorOf(glb({ asset: { version: "3.0" } })).detail).toContain('asset.version is "3.0"');
    expect(errorOf(glb({ asset: { version: "2.0" }, nodes: 3 })).detail).toContain("no body found");
  });

  test("have no mesh or external files", () => {
    expect(errorOf(glb({ ...createDescription(), meshes: [] })).title).toBe("Nothing to draw");
    expect(
      errorOf(glb({ ...createDescription(), images: [{ uri: "https://example.org/skin.png" }] })).detail,
    ).toContain("skin.png");
    expect(parseAvatarFile(glb({ ...createDescription(), images: [{ uri: "data:image/png;base64,AA==" }] })).vrm).toBe(
      false,
    );
  });

  test("are too large, with the size and the limit", () => {
    expect(fileTooLarge(MAX_FILE_BYTES + 1).detail).toBe("101 MB; the limit is 100 MB");
    expect(errorOf(new ArrayBuffer(MAX_FILE_BYTES + 1)).title).toBe("File too large");
  });
});
