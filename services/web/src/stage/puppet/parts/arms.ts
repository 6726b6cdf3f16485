/** Turned arms below the sleeves. */
import { FINISH } from "../finish";
import type { GeometryBuilder } from "../geometry-builder";
import { jointPosition, SIDES } from "../standard-figure";
import { ball, lathe, ring } from "../surface";

const UPPER_ARM = [
  [0.24, 0.0005],
  [0.26, 0.12],
  [0.42, 0.14],
  [0.68, 0.122],
  [0.8, 0.11],
  [0.835, 0.108],
  [0.85, 0.118],
  [0.875, 0.118],
  [0.895, 0.102],
  [0.9, 0.0005],
];
const FOREARM = [
  [0.08, 0.0005],
  [0.09, 0.115],
  [0.105, 0.132],
  [0.13, 0.133],
  [0.15, 0.122],
  [0.28, 0.142],
  [0.45, 0.136],
  [0.68, 0.105],
  [0.82, 0.088],
  [0.865, 0.086],
  [0.88, 0.098],
  [0.905, 0.098],
  [0.925, 0.08],
  [0.93, 0.0005],
];
export function addArms(builder: GeometryBuilder): void {
  for (const { side } of SIDES) {
    const [shoulder, elbow, wrist] = ["shoulder", "elbow", "wrist"].map((name) => `${side}_${name}`);
    const [shoulderAt, elbowAt, wristAt] = [jointPosition(shoulder), jointPosition(elbow), jointPosition(wrist)];
    const upperAxis = elbowAt.clone().sub(shoulderAt);
    const foreAxis = wristAt.clone().sub(elbowAt);
    const [upper, fore] = [upperAxis.length(), foreAxis.length()];

    builder.add(lathe(shoulderAt, elbowAt, UPPER_ARM), shoulder, FINISH.limb);
    builder.add(ball(elbowAt, 0.036), shoulder, FINISH.jointBall);
    builder.add(lathe(elbowAt, wristAt, FOREARM), elbow, FINISH.limb);
    builder.add(ball(wristAt, 0.0245, [1, 1, 1], 10), elbow, FINISH.jointBall);
    builder.add(ring(shoulderAt.clone().lerp(elbowAt, 0.862), upperAxis, 0.115 * upper, 0.0034), shoulder, FINISH.gold);
    builder.add(ring(elbowAt.clone().lerp(wristAt, 0.118), foreAxis, 0.129 * fore, 0.0034), elbow, FINISH.gold);
    builder.add(ring(elbowAt.clone().lerp(wristAt, 0.893), foreAxis, 0.0945 * fore, 0.003), elbow, FINISH.gold);
  }
}
