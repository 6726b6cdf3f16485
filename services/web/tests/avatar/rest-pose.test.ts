import { Quaternion, Vector3 } from "three";
import { describe, expect, test } from "vitest";
import { AvatarModel } from "../../src/avatar/model";
import type { RestMeasurements } from "../../src/avatar/rest-pose";
import { createFigureFile, type FigureOptions } from "./figure-files";

async function restOf(options: FigureOptions): Promise<RestMeasurements> {
  return (await AvatarModel.parse(createFigureFile(options).buffer, "boxes")).rest;
}

const positionOf = (rest: RestMeasurements, bone: string) => rest.bones.get(bone)?.position ?? new Vector3(NaN);

describe("the rest pose", () => {
  test.each<[string, FigureOptions]>([
    ["facing z", {}],
    ["facing away", { vrm: 0 }],
    ["facing aside", { facing: 90 }],
    ["on its back", { lying: true }],
    ["in an A-pose", { arms: 50, legs: 10 }],
    ["in centimetres", { unit: 0.01, askew: true }],
  ])("%s is rotated to face z, head up, left at +x", async (_, options) => {
    const rest = await restOf(options);
    expect(positionOf(rest, "head").y - positionOf(rest, "hips").y).toBeCloseTo(0.54, 2);
    expect(positionOf(rest, "leftUpperArm").x - positionOf(rest, "rightUpperArm").x).toBeCloseTo(0.32, 2);
    expect(positionOf(rest, "leftToes").z).toBeGreaterThan(positionOf(rest, "leftFoot").z + 0.1);
  });

  test("has soles at the lowest vertices of the feet, under heel and ball", async () => {
    const rest = await restOf({});
    expect(rest.soleHeight).toBeCloseTo(0, 6);
    const [heel, ball] = rest.solePoints.get("leftFoot") as Vector3[];
    const ankle = positionOf(rest, "leftFoot");
    // This figure's axes are those of the world.
    expect([heel.y, ball.y]).toEqual([expect.closeTo(-ankle.y, 6), expect.closeTo(-ankle.y, 6)]);
    expect(heel.z).toBeLessThan(0);
    expect(ball.z).toBeCloseTo(0.13, 6);
  });

  test("reaches up to the top of the head", async () => {
    const [plain, tall] = [await restOf({}), await restOf({ headHeight: 0.9, unit: 0.01, lying: true })];
    expect(tall.topHeight - plain.topHeight).toBeCloseTo(0.7, 3);
    expect(plain.topHeight).toBeCloseTo(positionOf(plain, "head").y + 0.2, 3);
  });

  test("estimates the ball without toes, and hand lengths to the finger tips", async () => {
    const rest = await restOf({ without: ["leftToes", "rightToes"] });
    const [, ball] = rest.solePoints.get("rightFoot") as Vector3[];
    expect(ball.z).toBeGreaterThan(0.08);
    // The corners of the box are slightly further away than its centre.
    expect(Math.abs((rest.handLengths.get("leftHand") ?? 0) - 0.17)).toBeLessThan(0.01);
  });

  test("has the rotation of each bone and of its parent", async () => {
    const rest = await restOf({ askew: true });
    const arm = rest.bones.get("leftLowerArm");
    const parent = rest.bones.get("leftUpperArm");
    expect(
      (arm?.parentRotation ?? new Quaternion()).angleTo(parent?.rotation ?? new Quaternion(0, 1, 0, 0)),
    ).toBeLessThan(1e-6);
  });
});
