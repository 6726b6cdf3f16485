import { Quaternion } from "three";
import { describe, expect, test } from "vitest";
import { BoneOrientations, DRIVEN_BONES } from "../../src/avatar/bone-orientations";
import { createExtendedPose, type ExtendedPose, extendPose } from "../../src/motion/extension";
import { BONES, createHumanoidPose, toHumanoid } from "../../src/motion/humanoid";
import { createWorldTransforms, type Figure, type WorldTransforms, worldTransforms } from "../../src/motion/skeleton";
import { extensionVectors, goldenBody } from "../golden-extensions";

const golden = extensionVectors();
const FULL = () => true;
const NONE = () => false;

function posed(vector: (typeof golden.poses)[number]) {
  const figure: Figure = { offsets: Float64Array.from(vector.offsets), tips: new Float64Array(54) };
  const pose = { root: Float64Array.from(vector.root), rotations: Float64Array.from(vector.rotations) };
  const world = worldTransforms(figure, pose, createWorldTransforms());
  const extension = goldenBody(golden.tracks[vector.track]);
  const extended = extendPose(figure, world, Float64Array.from(vector.values), createExtendedPose(extension));
  return { figure, pose, world, extended };
}

/** Return the orientation of each bone, from local rotations. */
function worldOf(orientations: BoneOrientations, world: WorldTransforms, extended: ExtendedPose | null) {
  const rotations = new Float64Array(orientations.bones.length * 4);
  orientations.rotations(world, extended, rotations);
  const found: Quaternion[] = [];
  orientations.bones.forEach((_, bone) => {
    const [w, x, y, z] = rotations.subarray(bone * 4);
    const local = new Quaternion(x, y, z, w);
    const parent = orientations.parents[bone];
    found.push(parent < 0 ? local : found[parent].clone().multiply(local));
  });
  return new Map(orientations.bones.map((bone, at) => [bone, found[at]]));
}

/** Return the angle between two orientations, in radians. */
const apart = (a: Quaternion | undefined, b: Quaternion | undefined) => (a as Quaternion).angleTo(b as Quaternion);
const orientation = (values: Float64Array, joint: number) => {
  const [w, x, y, z] = values.subarray(joint * 4);
  return new Quaternion(x, y, z, w);
};

test("an avatar without further bones has those of the figure", () => {
  const { figure, pose, world } = posed(golden.poses[1]);
  const orientations = new BoneOrientations(NONE);
  expect(orientations.bones).toEqual(BONES);
  const out = new Float64Array(BONES.length * 4);
  orientations.rotations(world, null, out);
  toHumanoid(figure, pose, createHumanoidPose()).rotations.forEach((value, at) =>
    expect(out[at]).toBeCloseTo(value, 9),
  );
});

test("parents are the nearest bones that there are", () => {
  const orientations = new BoneOrientations((bone) => bone === "chest" || bone === "leftShoulder");
  const above = (bone: string) => orientations.bones[orientations.parents[orientations.bones.indexOf(bone)]];
  expect(["head", "leftUpperArm", "rightUpperArm", "leftShoulder", "chest", "spine"].map(above)).toEqual([
    "chest",
    "leftShoulder",
    "chest",
    "chest",
    "spine",
    "hips",
  ]);
  expect(new BoneOrientations(FULL).bones).toEqual(DRIVEN_BONES);
});

test("without an extension, further bones rest and limbs stay as they are", () => {
  const { world } = posed(golden.poses[1]);
  const full = worldOf(new BoneOrientations(FULL), world, null);
  const plain = worldOf(new BoneOrientations(NONE), world, null);
  for (const bone of BONES) expect(apart(full.get(bone), plain.get(bone))).toBeLessThan(1e-6);
  for (const bone of ["chest", "upperChest", "neck", "leftShoulder"])
    expect(apart(full.get(bone), full.get("spine"))).toBeLessThan(1e-6);
});

describe.each(golden.poses)("extended pose of track $track", (vector) => {
  const { world, extended } = posed(vector);
  const { kinds } = extended.extension;
  const chest = kinds.lastIndexOf("spine");
  const chestOrientation =
    chest < 0 ? orientation(world.orientations, 0) : orientation(extended.extraOrientations, chest);

  test.each([
    ["all bones", FULL],
    ["no further bones", NONE],
    ["chest and shoulders only", (bone: string) => bone === "chest" || bone.endsWith("Shoulder")],
  ])("an avatar with %s turns its chest and hands as the figure does", (_, has) => {
    const orientations = new BoneOrientations(has);
    const found = worldOf(orientations, world, extended);
    const trunk = ["spine", "chest", "upperChest"].filter((bone) => orientations.bones.includes(bone));
    expect(apart(found.get(trunk.at(-1) as string), chestOrientation)).toBeLessThan(1e-6);
    const plain = worldOf(new BoneOrientations(NONE), world, null);
    for (const bone of ["head", "leftHand", "rightHand", "leftFoot"])
      expect(apart(found.get(bone), plain.get(bone))).toBeLessThan(1e-6);
    const clavicle = kinds.indexOf("left clavicle");
    if (orientations.bones.includes("leftShoulder") && clavicle >= 0)
      expect(apart(found.get("leftShoulder"), orientation(extended.extraOrientations, clavicle))).toBeLessThan(1e-6);
  });
});
