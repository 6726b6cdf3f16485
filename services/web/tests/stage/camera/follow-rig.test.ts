import { Matrix4, Quaternion, Vector3 } from "three";
import { describe, expect, test } from "vitest";
import { FollowRig } from "../../../src/stage/camera/follow-rig";
import type { Performer } from "../../../src/stage/puppet/performer";

type RigTarget = Pick<Performer, "root" | "ground">;

/** Create a performer at x, z on a floor at y, turned by `yaw`. */
function createPerformer(x: number, y: number, z: number, yaw = 0): RigTarget {
  const turn = new Quaternion().setFromAxisAngle(new Vector3(0, 1, 0), yaw);
  return { root: new Matrix4().compose(new Vector3(x, y + 0.85, z), turn, new Vector3(1, 1, 1)), ground: y };
}

function follow(rig: FollowRig, puppet: RigTarget, seconds: number): void {
  for (let t = 0; t < seconds; t += 1 / 60) rig.follow([puppet], 1 / 60);
}

describe("the rig", () => {
  test("starts at the performer's position", () => {
    const rig = new FollowRig();
    rig.follow([createPerformer(3, 0.2, -2)], 0);
    expect(rig.group.position.distanceTo(new Vector3(3, 0.2, -2))).toBeLessThan(1e-9);
  });

  test("starts facing the motion's front, whichever way the performer faces", () => {
    const rig = new FollowRig();
    rig.reset(2.8);
    rig.follow([createPerformer(0, 0, 0, 0.4)], 1 / 60);
    expect(rig.group.rotation.y).toBeCloseTo(2.8, 6);
    follow(rig, createPerformer(0, 0, 0, 2.5), 5);
    expect(rig.group.rotation.y).toBeCloseTo(2.8, 1);
  });

  test("ignores small steps, follows a walk and moves the boards with it", () => {
    const rig = new FollowRig();
    follow(rig, createPerformer(0, 0, 0), 0.1);
    follow(rig, createPerformer(0.2, 0, 0), 2);
    expect(rig.group.position.x).toBe(0);
    follow(rig, createPerformer(1, 0, 0), 10);
    expect(rig.group.position.x).toBeCloseTo(0.75, 2);
    expect(rig.floorOffset.x).toBeCloseTo(0.75, 2);
  });

  test("cuts to a performer who was moved, without sliding the boards", () => {
    const rig = new FollowRig();
    follow(rig, createPerformer(0, 0, 0), 0.1);
    rig.follow([createPerformer(5, 0, 5)], 1 / 60);
    expect(rig.group.position.x).toBe(5);
    expect(rig.floorOffset.length()).toBe(0);
  });

  test("keeps the floor under the feet, but does not follow a jump", () => {
    const rig = new FollowRig();
    follow(rig, createPerformer(0, 0, 0), 0.1);
    follow(rig, createPerformer(0, 0.08, 0), 12);
    expect(rig.group.position.y).toBeCloseTo(0.08, 2);
    follow(rig, createPerformer(0, 0.6, 0), 0.5);
    expect(rig.group.position.y).toBeCloseTo(0.08, 2);
    follow(rig, createPerformer(0, -0.3, 0), 4);
    expect(rig.group.position.y).toBeCloseTo(-0.3, 2);
  });

  test("turns to a new facing, but not with a pirouette", () => {
    const steady = new FollowRig();
    follow(steady, createPerformer(0, 0, 0, Math.PI / 2), 20);
    expect(steady.group.rotation.y).toBeGreaterThan(0.3);
    const turning = new FollowRig();
    for (let t = 0; t < 20; t += 1 / 60) turning.follow([createPerformer(0, 0, 0, 4 * t)], 1 / 60);
    expect(Math.abs(turning.group.rotation.y)).toBeLessThan(0.3);
  });

  test("stands between several performers on the lowest one's floor", () => {
    const rig = new FollowRig();
    const at = (x: number) => [createPerformer(x - 2, 0.1, 1), createPerformer(x, 0, -1), createPerformer(x + 1, 0, 0)];
    rig.follow(at(0), 0);
    expect(rig.group.position.distanceTo(new Vector3(-0.5, 0, 0))).toBeLessThan(1e-9);
    rig.widthScale = 2;
    for (let t = 0; t < 10; t += 1 / 60) rig.follow(at(1), 1 / 60);
    expect(rig.group.position.x).toBeCloseTo(0.25, 2);
    expect(rig.floorOffset.x).toBeCloseTo(0.375, 2);
  });

  test("does not turn to performers who face each other", () => {
    const rig = new FollowRig();
    for (let t = 0; t < 20; t += 1 / 60)
      rig.follow([createPerformer(-1, 0, 0, Math.PI / 2), createPerformer(1, 0, 0, -Math.PI / 2)], 1 / 60);
    expect(rig.group.rotation.y).toBeCloseTo(0, 6);
  });
});
