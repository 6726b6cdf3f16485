import { Matrix4, Quaternion, Vector3 } from "three";
import { describe, expect, test } from "vitest";
import { floorHeight, handlePosition, type JointSource } from "../../../src/stage/puppet/performer";
import { SOLE_HEIGHT_M, jointPosition as standing } from "../../../src/stage/puppet/standard-figure";
import { createStandingPuppet } from "./figures";

/** Height of the ankle above the ball of the standard figure's foot. */
const ANKLE = standing("l_ankle").y - standing("l_midtarsal").y;

/** Return the standard figure with joints lifted or pitched as given. */
function standingWith(moved: Record<string, { lift?: number; pitch?: number }>): JointSource {
  const joint = (name: string) => {
    const { lift = 0, pitch = 0 } = moved[name] ?? {};
    return new Matrix4().compose(
      standing(name).add(new Vector3(0, lift, 0)),
      new Quaternion().setFromAxisAngle(new Vector3(1, 0, 0), pitch),
      new Vector3(1, 1, 1),
    );
  };
  return { joint, scale: 1 };
}

describe("the floor under a performer", () => {
  test("is under the soles of a standing figure and of the puppet", () => {
    const floor = standing("l_midtarsal").y - SOLE_HEIGHT_M;
    expect(floorHeight(standingWith({}), ANKLE)).toBeCloseTo(floor, 9);
    expect(createStandingPuppet().ground).toBeCloseTo(floor, 9);
  });

  test("is under the standing foot, and under a heel below its ball", () => {
    const lifted = { l_midtarsal: { lift: 0.4 }, l_ankle: { lift: 0.4 } };
    expect(floorHeight(standingWith(lifted), ANKLE)).toBeCloseTo(floorHeight(standingWith({}), ANKLE), 9);
    const onHeel = { ...lifted, r_midtarsal: { lift: 0.1 }, r_ankle: { pitch: -0.5 } };
    const heel = new Vector3(0, -ANKLE, -0.045).applyAxisAngle(new Vector3(1, 0, 0), -0.5).y + standing("r_ankle").y;
    expect(floorHeight(standingWith(onHeel), ANKLE)).toBeCloseTo(heel - SOLE_HEIGHT_M, 9);
  });
});

describe("hands of the puppet", () => {
  test("have the axes of their joints, and points between wrist and tip", () => {
    for (const [limb, name] of ["l_wrist", "r_wrist"].entries()) {
      const puppet = createStandingPuppet(0.5);
      const wrist = puppet.joint(name);
      const [start, tip] = [0, 1].map((share) => puppet.hand(limb, share, new Matrix4()));
      expect(start.elements).toEqual(wrist.elements);
      const along = new Vector3().setFromMatrixPosition(tip).sub(new Vector3().setFromMatrixPosition(wrist));
      expect(along.y).toBeLessThan(-0.15);
      const axes = new Matrix4().extractRotation(tip);
      axes.elements.forEach((value, at) =>
        expect(value).toBeCloseTo(new Matrix4().extractRotation(wrist).elements[at], 9),
      );
    }
  });
});

describe("handles of a performer", () => {
  test("are below the wrists, mirrored, and rotate with them", () => {
    const [left, right] = [0, 1].map((limb) => handlePosition(standingWith({}), limb, new Vector3()));
    expect(left.distanceTo(standing("l_wrist").add(new Vector3(0.004, -0.075, 0.004)))).toBeLessThan(1e-9);
    expect(right.x).toBeCloseTo(-left.x, 9);
    const turned = handlePosition(standingWith({ l_wrist: { pitch: -Math.PI / 2 } }), 0, new Vector3());
    expect(turned.z - standing("l_wrist").z).toBeCloseTo(0.075, 9);
  });

  test("scale with the figure, and equal the streamed ones on the puppet", () => {
    const large = handlePosition({ ...standingWith({}), scale: 2 }, 2, new Vector3());
    expect(large.z - standing("l_knee").z).toBeCloseTo(0.016, 9);
    const to = new Vector3(1, 2, 3);
    expect(createStandingPuppet().toStreamedHandle(0, to, new Vector3()).equals(to)).toBe(true);
  });
});
