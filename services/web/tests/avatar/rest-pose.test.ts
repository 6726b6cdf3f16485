import { Quaternion, Vector3 } from "three";
import { describe, expect, test } from "vitest";
import { AvatarModel } from "../../src/avatar/model";
import { drivenParent, type RestMeasurements } from "../../src/avatar/rest-pose";
import { createFigureFile, type FigureOptions } from "./figure-files";

async function restOf(options: FigureOptions): Promise<RestMeasurements> {
  return (await AvatarModel.parse(createFigureFile(options).buffer, "boxes")).rest;
}

const place = (rest: RestMeasurements, bone: string) => rest.bones.get(bone)?.position ?? new Vector3(NaN);

describe("how a model stands", () => {
  test.each<[string, FigureOptions]>([
    ["facing z", {}],
    ["facing away", { vrm: 0 }],
    ["facing aside", { facing: 90 }],
    ["on its back", { lying: true }],
    ["in an A-pose", { arms: 50, legs: 10 }],
    ["in centimetres", { unit: 0.01, askew: true }],
  ])("%s it is turned to face z, head up, left at x", async (_, options) => {
    const rest = await restOf(options);
    expect(place(rest, "head").y - place(rest, "hips").y).toBeCloseTo(0.54, 2);
    expect(place(rest, "leftUpperArm").x - place(rest, "rightUpperArm").x).toBeCloseTo(0.32, 2);
    expect(place(rest, "leftToes").z).toBeGreaterThan(place(rest, "leftFoot").z + 0.1);
  });

  test("its soles are as low as its feet's mesh goes, under heel and ball", async () => {
    const rest = await restOf({});
    expect(rest.soleHeight).toBeCloseTo(0, 6);
    const [heel, ball] = rest.solePoints.get("leftFoot") as Vector3[];
    const ankle = place(rest, "leftFoot");
    // this figure's axes are the world's
    expect([heel.y, ball.y]).toEqual([expect.closeTo(-ankle.y, 6), expect.closeTo(-ankle.y, 6)]);
    expect(heel.z).toBeLessThan(0);
    expect(ball.z).toBeCloseTo(0.13, 6);
  });

  test("without toes the ball is towards the front of the foot; hands reach to the tips of their fingers", async () => {
    const rest = await restOf({ without: ["leftToes", "rightToes"] });
    const [, ball] = rest.solePoints.get("rightFoot") as Vector3[];
    expect(ball.z).toBeGreaterThan(0.08);
    // the corners of its box are a little further than its middle
    expect(Math.abs((rest.handLengths.get("leftHand") ?? 0) - 0.17)).toBeLessThan(0.01);
  });

  test("of every bone it knows its own turn and that of what it hangs from", async () => {
    const rest = await restOf({ askew: true });
    const arm = rest.bones.get("leftLowerArm");
    const above = rest.bones.get("leftUpperArm");
    expect(
      (arm?.parentRotation ?? new Quaternion()).angleTo(above?.rotation ?? new Quaternion(0, 1, 0, 0)),
    ).toBeLessThan(1e-6);
  });
});

test("arms and head hang from the spine, and the hips from nothing", () => {
  expect(["leftUpperArm", "head", "rightFoot", "spine", "hips"].map(drivenParent)).toEqual([
    "spine",
    "spine",
    "rightLowerLeg",
    "hips",
    null,
  ]);
});
