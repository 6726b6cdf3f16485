import { describe, expect, test } from "vitest";
import {
  findSpellings,
  NameIndex,
  normaliseName,
  splitWords,
  stripNumbers,
} from "../../../src/avatar/naming/joint-name";
import { PROFILES } from "../../../src/avatar/naming/naming-profile";

describe("names of joints", () => {
  test.each([
    ["rig:upper_arm.L", "upperarml"],
    ["Bip01 L Thigh", "bip01lthigh"],
    ["a|b|Hips", "hips"],
    ["Hips:", "hips"],
    ["\uff28\uff49\uff50\uff53", "hips"],
  ])("%s is normalised", (name, plain) => {
    expect(normaliseName(name)).toBe(plain);
  });

  test.each([
    ["rig:upper_arm.L", ["upper", "arm", "l"]],
    ["LThigh", ["l", "thigh"]],
    ["leftUpLeg2", ["left", "up", "leg", "2"]],
    ["LEFT_ARM", ["left", "arm"]],
    ["\u4e0a\u534a\u8eab2", ["\u4e0a\u534a\u8eab", "2"]],
    ["", []],
  ])("%s is split into words", (name, words) => {
    expect(splitWords(name)).toEqual(words);
  });

  test("lose the numbers of the joints if most have one", () => {
    expect(stripNumbers(["root", "Hips_01", "Spine_02", "Spine1_03", "LeftArm_012"])).toEqual([
      "root",
      "Hips",
      "Spine",
      "Spine1",
      "LeftArm",
    ]);
    expect(stripNumbers(["pelvis", "spine_01", "spine_02", "head"])).toBe(null);
    expect(stripNumbers([])).toBe(null);
  });
});

describe("a spelling", () => {
  test("leads from one knee to all joints", () => {
    const index = new NameIndex(["rig_Pelvis_jnt", "rig_L_Calf_jnt", "rig_R_Calf_jnt"], [-1, 0, 0]);
    const profile = PROFILES.find(({ name }) => name === "Unreal") ?? PROFILES[0];
    const [spelling] = findSpellings(profile, index);
    expect([0, 1].map((side) => index.find(spelling.limbKey(side, "calf"), 0, new Set()))).toEqual([1, 2]);
    expect(index.find(spelling.trunkKey("pelvis"), null, new Set())).toBe(0);
    expect(index.find(spelling.limbKey(0, "calf"), null, new Set([1]))).toBe(undefined);
    expect(findSpellings(profile, index, "elbow")).toEqual([]);
  });

  test("is one of few, however many names are like a knee", () => {
    const names = Array.from({ length: 1000 }, (_, number) => `a${number}leftleg`);
    const index = new NameIndex(names, [-1, ...names.keys()].slice(0, 1000));
    for (const profile of PROFILES) expect(findSpellings(profile, index).length).toBeLessThanOrEqual(64);
  });

  test("has the names that a pattern matches whole", () => {
    const index = new NameIndex(["CC_Base_Hip"], [-1]);
    expect([index.hasName("ccbase.*"), index.hasName("ccbase")]).toEqual([true, false]);
  });
});
