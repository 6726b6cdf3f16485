/** Turned arms below the sleeves, and gofun hands with four fingers and a thumb, palms towards the body. */
import { Vector3 } from "three";
import { FINISH } from "../finish";
import type { GeometryBuilder } from "../geometry-builder";
import { jointPosition, SIDES } from "../standard-figure";
import { ball, capsule, curve, grid, lathe, ring, signedPower } from "../surface";

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
/** Palm: (position, half thickness, half width). */
const PALM_SECTIONS = [
  [0, 0.0005, 0.0005],
  [0.05, 0.016, 0.013],
  [0.25, 0.019, 0.02],
  [0.55, 0.0215, 0.034],
  [0.85, 0.0175, 0.0385],
  [0.97, 0.012, 0.034],
  [1, 0.0005, 0.0005],
];
/** Fingers, little to index: (z of the knuckle, length, curl towards the palm). */
const FINGERS = [
  [-0.0245, 0.07, 0.02],
  [-0.0075, 0.083, 0.017],
  [0.0098, 0.086, 0.014],
  [0.0268, 0.076, 0.012],
];

export function addArms(builder: GeometryBuilder): void {
  for (const { side, sign } of SIDES) {
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
    addHand(builder, wrist, wristAt, sign);
  }
}

function addHand(builder: GeometryBuilder, wrist: string, wristAt: Vector3, sign: number): void {
  const at = (x: number, y: number, z: number) => new Vector3(wristAt.x + sign * x, wristAt.y + y, wristAt.z + z);
  const palm = curve(PALM_SECTIONS);
  builder.add(
    grid(
      (u, v) => {
        const [thick, half] = palm(v);
        const angle = u * 2 * Math.PI;
        const x = 0.003 + signedPower(Math.sin(angle), 0.8) * thick * 0.8;
        return at(x, -0.016 - 0.088 * v, 0.006 * v + signedPower(Math.cos(angle), 0.9) * half);
      },
      14,
      9,
    ),
    wrist,
    FINISH.hand,
  );
  FINGERS.forEach(([z, length, curl], finger) => {
    const knuckle = finger === 0 || finger === 3 ? -0.092 : -0.096;
    const root = at(0.003, knuckle, z + 0.006);
    const middle = at(0.002 - curl * 0.35, -0.096 - length * 0.5, z * 1.02 + 0.006);
    const tip = at(-curl * 1.15, -0.096 - length * 0.95, z * 0.98 + 0.005);
    builder.add(capsule(root, middle, 0.0088, 0.0082), wrist, FINISH.hand);
    builder.add(capsule(middle, tip, 0.0082, 0.0062), wrist, FINISH.hand);
  });
  const [root, middle, tip] = [at(-0.002, -0.034, 0.026), at(-0.01, -0.066, 0.047), at(-0.014, -0.094, 0.053)];
  builder.add(capsule(root, middle, 0.0115, 0.0098), wrist, FINISH.hand);
  builder.add(capsule(middle, tip, 0.0098, 0.007), wrist, FINISH.hand);
}
