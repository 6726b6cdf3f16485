import { Object3D, Quaternion, Vector3 } from "three";
import { expect, test } from "vitest";
import { type Leg, MAX_STRETCH, turnLeg } from "../../../src/stage/puppet/leg-turn";

const THIGH = 0.42;
const SHANK = 0.4;

let state = 11;
const random = (low = -1, high = 1) => low + (high - low) * ((state = (state * 48271) % 2147483647) / 2147483647);
const randomRotation = () =>
  new Quaternion().setFromAxisAngle(new Vector3(random(), random(), random()).normalize(), random(-3, 3));
const worldOf = (node: Object3D) => new Vector3().setFromMatrixPosition(node.matrixWorld);

/** Return a leg whose knee is bent by `bend` radians, in a random frame. */
function createLeg(bend: number): Leg {
  const [stand, hip, knee, ankle] = [new Object3D(), new Object3D(), new Object3D(), new Object3D()];
  stand.add(hip);
  hip.add(knee);
  knee.add(ankle);
  stand.quaternion.copy(randomRotation());
  stand.position.set(random(), random(), random());
  stand.scale.setScalar(random(0.5, 2));
  hip.quaternion.copy(randomRotation());
  knee.position.set(0, -THIGH, 0);
  knee.quaternion.setFromAxisAngle(new Vector3(1, 0, random(-0.1, 0.1)).normalize(), bend);
  ankle.position.set(0, -SHANK, 0);
  ankle.quaternion.copy(randomRotation());
  stand.updateMatrixWorld(true);
  return { hip, knee, ankle, hinge: new Vector3(1, 0, 0) };
}

test("the ankle comes to any place within reach, in the direction that it has", () => {
  for (let run = 0; run < 300; run++) {
    const leg = createLeg(random(0.05, 2.2));
    const [hip, direction] = [worldOf(leg.hip), leg.ankle.getWorldQuaternion(new Quaternion())];
    const scale = leg.hip.getWorldScale(new Vector3()).x;
    const along = new Vector3(random(), random(), random()).normalize();
    const target = along.multiplyScalar(scale * random(0.1, MAX_STRETCH * (THIGH + SHANK))).add(hip);
    turnLeg(leg, target, worldOf(leg.ankle).distanceTo(target));
    expect(worldOf(leg.ankle).distanceTo(target) / scale).toBeLessThan(1e-6);
    expect(leg.ankle.getWorldQuaternion(new Quaternion()).angleTo(direction)).toBeLessThan(1e-6);
    expect(worldOf(leg.knee).distanceTo(hip) / scale).toBeCloseTo(THIGH, 9);
  }
});

test("a place out of reach gives the nearest one", () => {
  const leg = createLeg(0.5);
  const [hip, scale] = [worldOf(leg.hip), leg.hip.getWorldScale(new Vector3()).x];
  turnLeg(leg, hip.clone().add(new Vector3(9, 0, 0)), 9);
  const reached = worldOf(leg.ankle).sub(hip).divideScalar(scale);
  expect(reached.distanceTo(new Vector3(MAX_STRETCH * (THIGH + SHANK), 0, 0))).toBeLessThan(1e-6);
});

test("the place where the ankle is leaves the leg as it is, whatever way it is bent", () => {
  for (const bend of [-0.2, -0.01, 0, 0.01, 0.2, 1.5]) {
    const leg = createLeg(bend);
    const before = [leg.hip, leg.knee, leg.ankle].map(({ quaternion }) => quaternion.clone());
    turnLeg(leg, worldOf(leg.ankle), 0);
    [leg.hip, leg.knee, leg.ankle].forEach(({ quaternion }, n) => {
      // of a straight leg, rounding is seen as its root
      expect(quaternion.angleTo(before[n])).toBeLessThan(1e-6);
    });
  }
});
