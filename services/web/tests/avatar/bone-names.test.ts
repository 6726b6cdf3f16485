import { describe, expect, test } from "vitest";
import { findBones, missingBones, type NamedNode, parseNodeName, REQUIRED_BONES } from "../../src/avatar/bone-names";
import { SKELETONS } from "./skeletons";

/** Return the node names found for bones. */
function namesOf(nodes: readonly NamedNode[], ...bones: string[]): (string | undefined)[] {
  const all = findBones(nodes);
  return bones.map((bone) => nodes[all.get(bone) ?? -1]?.name);
}

describe("node names", () => {
  test.each([
    ["mixamorig:LeftForeArm", "forearm", "left"],
    ["mixamorigRightUpLeg", "upleg", "right"],
    ["J_Bip_L_UpperArm", "upperarm", "left"],
    ["Bip01 R Toe0", "toe", "right"],
    ["upper_arm.L", "upperarm", "left"],
    ["rig|lHip", "hip", "left"],
    ["RThigh", "thigh", "right"],
    ["spine_01", "spine", ""],
    ["vl5", "vl5", ""],
    ["mixamorig:Hips_01", "hips", ""],
    ["upperarm_twist_01_l", "upperarmtwist", "left"],
  ])("%s", (name, word, side) => {
    expect(parseNodeName(name)).toEqual({ word, side });
  });
});

describe("bones", () => {
  test.each(Object.entries(SKELETONS))("of %s are all found, each on its side", (_, nodes) => {
    const bones = findBones(nodes);
    expect(missingBones(bones)).toEqual([]);
    expect(new Set(bones.values()).size).toBe(bones.size);
    for (const [bone, node] of bones) {
      const side = bone.startsWith("left") ? "left" : bone.startsWith("right") ? "right" : "";
      expect(parseNodeName(nodes[node].name).side).toBe(side);
    }
    expect(bones.has("leftToes") && bones.has("rightToes")).toBe(true);
  });

  test("distinguish upper arm and collar bone, lower leg and thigh", () => {
    expect(namesOf(SKELETONS["Mixamo"], "leftUpperArm", "leftLowerLeg", "spine", "leftMiddleProximal")).toEqual([
      "mixamorig:LeftArm",
      "mixamorig:LeftLeg",
      "mixamorig:Spine",
      "mixamorig:LeftHandMiddle1",
    ]);
    expect(namesOf(SKELETONS["VRChat"], "leftUpperArm", "leftLowerLeg", "rightFoot")).toEqual([
      "Left arm",
      "Left knee",
      "Right ankle",
    ]);
    expect(namesOf(SKELETONS["H-Anim"], "hips", "spine", "rightUpperArm")).toEqual([
      "humanoid_root",
      "vl5",
      "r_shoulder",
    ]);
    expect(namesOf(SKELETONS["Unreal"], "hips", "leftHand", "rightFoot", "leftLowerArm")).toEqual([
      "pelvis",
      "hand_l",
      "foot_r",
      "lowerarm_l",
    ]);
  });

  test("outside their limb are ignored", () => {
    expect(namesOf(SKELETONS["3ds Max"], "leftUpperLeg")).toEqual(["Bip01 L Thigh"]);
    const loose = SKELETONS["Unreal"].map((node) => (node.name === "hand_l" ? { ...node, parent: 0 } : node));
    expect(missingBones(findBones(loose))).toEqual(["left hand"]);
  });

  test("that are missing are listed in plain words", () => {
    const armless = SKELETONS["Mixamo"]
      .filter(({ name }) => !/(?:LeftForeArm|LeftHand)/.test(name))
      .map(({ name }, _, all) => {
        const parent = SKELETONS["Mixamo"].find((node) => node.name === name)?.parent ?? -1;
        return { name, parent: all.findIndex((node) => node.name === SKELETONS["Mixamo"][parent]?.name) };
      });
    expect(missingBones(findBones(armless))).toEqual(["left lower arm", "left hand"]);
    expect(missingBones(findBones([{ name: "Cube", parent: -1 }]))).toHaveLength(REQUIRED_BONES.length);
  });

  test("are searched in cyclic files without hanging", () => {
    expect(
      missingBones(
        findBones([
          { name: "hips", parent: 1 },
          { name: "spine", parent: 0 },
        ]),
      ),
    ).not.toContain("spine");
  });
});
