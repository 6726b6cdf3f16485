import { expect, test } from "vitest";
import { normaliseName } from "../../../src/avatar/naming/joint-name";
import { ARM_JOINTS, LEG_JOINTS, PROFILES, SIDE_WORDS } from "../../../src/avatar/naming/naming-profile";

test("every convention has patterns for all joints of the limbs", () => {
  expect([LEG_JOINTS, ARM_JOINTS]).toEqual([
    ["hip", "knee", "ankle", "midtarsal"],
    ["shoulder", "elbow", "wrist"],
  ]);
  expect(PROFILES.length).toBeGreaterThan(20);
  for (const { limbs, trunk, sideWords } of PROFILES) {
    expect(Object.keys(limbs)).toEqual([...LEG_JOINTS, ...ARM_JOINTS]);
    expect(SIDE_WORDS).toContainEqual(sideWords);
    for (const pattern of [...Object.values(limbs), ...Object.values(trunk)])
      for (const word of pattern.split("|")) expect(normaliseName(word)).toBe(word);
  }
});
