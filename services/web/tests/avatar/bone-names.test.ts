import { Vector3 } from "three";
import { describe, expect, test } from "vitest";
import { findBones, type JointTree, missingBones, REQUIRED_BONES } from "../../src/avatar/bone-names";
import { splitWords } from "../../src/avatar/naming/joint-name";
import { loadVectors } from "../golden-vectors";
import { type NamedNode, SKELETONS, treeOf } from "./skeletons";

/** Return the node names found for bones. */
function namesOf(nodes: readonly NamedNode[], ...bones: string[]): (string | undefined)[] {
  const all = findBones(treeOf(nodes));
  return bones.map((bone) => nodes[all.get(bone) ?? -1]?.name);
}

/** Return the skeleton whose joints have no known names. */
function shapedBody(): JointTree {
  const [{ names, parents, positions }] = loadVectors<{
    by_shape: { names: string[]; parents: number[]; positions: [number, number, number][] }[];
  }>("joint_mapping").by_shape;
  return { names, parents, positions: positions.map((position) => new Vector3(...position)) };
}

/** Return nodes without some, whose children hang from their parents. */
function without(nodes: readonly NamedNode[], pattern: RegExp): NamedNode[] {
  const kept = nodes.filter(({ name }) => !pattern.test(name));
  const indexOf = (parent: number): number => {
    const at = kept.indexOf(nodes[parent]);
    return parent < 0 || at >= 0 ? at : indexOf(nodes[parent].parent);
  };
  return kept.map(({ name, parent }) => ({ name, parent: indexOf(parent) }));
}

describe("bones", () => {
  test.each(Object.entries(SKELETONS))("of %s are all found, each on its side", (_, nodes) => {
    const bones = findBones(treeOf(nodes));
    expect(missingBones(bones)).toEqual([]);
    expect(new Set(bones.values()).size).toBe(bones.size);
    for (const [bone, node] of bones) {
      const words = splitWords(nodes[node].name);
      for (const side of ["left", "right"])
        expect(words.includes(side) || words.includes(side[0])).toBe(bone.startsWith(side));
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
    expect(missingBones(findBones(treeOf(loose)))).toEqual(["left hand"]);
  });

  test("that end a limb need no known name", () => {
    const renamed = SKELETONS["VRChat"].map((node) => ({ ...node, name: node.name.replace(/wrist|ankle/, "end") }));
    expect(namesOf(renamed, "leftHand", "rightFoot")).toEqual(["Left end", "Right end"]);
  });

  test("that are missing are listed in plain words", () => {
    const armless = without(SKELETONS["Mixamo"], /LeftForeArm|LeftHand/);
    expect(missingBones(findBones(treeOf(armless)))).toEqual(["left lower arm", "left hand"]);
    const halved = without(SKELETONS["Mixamo"], /Leg|Foot|Toe/);
    expect(missingBones(findBones(treeOf(halved)))).toHaveLength(8);
    expect(missingBones(findBones(treeOf([{ name: "Cube", parent: -1 }])))).toHaveLength(REQUIRED_BONES.length);
  });

  test("without known names are found by the shape", () => {
    const { names, parents, positions } = shapedBody();
    const bones = findBones({ names, parents, positions });
    expect(missingBones(bones)).toEqual([]);
    const nameOf = (bone: string) => names[bones.get(bone) ?? -1];
    expect(["hips", "spine", "head", "leftUpperArm", "rightHand", "leftFoot"].map(nameOf)).toEqual([
      "torso",
      "torso2",
      "neck",
      "arm_L_4",
      "arm_R_2",
      "leg_L_3",
    ]);
  });

  test("found by the shape are on the sides that their names say, or that glTF has without feet", () => {
    const { names, parents, positions } = shapedBody();
    const leftHand = (tree: Partial<JointTree>) =>
      names[findBones({ names, parents, positions, ...tree }).get("leftHand") ?? -1];
    const mirrored = positions.map(({ x, y, z }) => new Vector3(-x, y, z));
    const unnamed = names.map((_, joint) => `joint ${joint}`);
    expect([leftHand({ positions: mirrored }), leftHand({ names: unnamed })]).toEqual(["arm_L_2", "arm_L_2"]);
    // A body of which left and right are exchanged shows its feet; without feet it faces z.
    const toes = names.map((name) => name.endsWith("5"));
    const footless = positions.map((position, joint) => (toes[joint] ? positions[parents[joint]] : position));
    expect(leftHand({ names: unnamed, positions: footless })).toBe("arm_L_2");
    expect(leftHand({ names: unnamed, positions: footless.map(({ x, y, z }) => new Vector3(-x, y, z)) })).toBe(
      "arm_R_2",
    );
  });
});
