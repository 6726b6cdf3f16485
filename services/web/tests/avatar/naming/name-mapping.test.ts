import { describe, expect, test } from "vitest";
import { findHeadByName, mapByName, mapPartly } from "../../../src/avatar/naming/name-mapping";
import { loadVectors } from "../../golden-vectors";

interface NamedSkeleton {
  readonly why: string;
  readonly names: readonly string[];
  readonly parents: readonly number[];
  readonly profile: string | null;
  readonly joints: Readonly<Record<string, number>> | null;
}

const { by_name } = loadVectors<{ by_name: readonly NamedSkeleton[] }>("joint_mapping");
const isMapped = ({ joints }: NamedSkeleton) => joints !== null;

describe("joints by their names", () => {
  test.each(by_name.filter(isMapped))("are those of the server: $why", ({ names, parents, profile, joints }) => {
    const found = mapByName(names, parents);
    expect(found?.profile).toBe(profile);
    expect(Object.fromEntries(found?.joints ?? [])).toEqual(joints);
  });

  test.each(by_name.filter((skeleton) => !isMapped(skeleton)))("are not found: $why", ({ names, parents }) => {
    expect(mapByName(names, parents)).toBe(null);
  });

  test("are found in part where some are missing", () => {
    const { names, parents } = by_name.find(({ why }) => why === "names of Mixamo") as NamedSkeleton;
    const without = names.map((name) => name.replace("LeftForeArm", "Cylinder"));
    expect(mapByName(without, parents)).toBe(null);
    const found = mapPartly(without, parents);
    expect(found.has("l_elbow")).toBe(false);
    expect(without[found.get("r_elbow") ?? -1]).toBe("mixamorig:RightForeArm");
    expect(mapPartly(["Cube", "Left wheel", "Right wheel"], [-1, 0, 0]).size).toBe(0);
    expect(mapPartly([], []).size).toBe(0);
  });

  test("a head is found by its name outside the limbs", () => {
    const names = ["hips", "left_leg", "head_of_femur", "left_head", "neck", "Bip01 Head"];
    const parents = [-1, 0, 1, 1, 0, 4];
    const joints = new Map([["l_hip", 1]]);
    expect(findHeadByName(names, parents, joints)).toBe(5);
    expect(findHeadByName(names.slice(0, 5), parents, joints)).toBe(undefined);
  });
});
