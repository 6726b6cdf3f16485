/** Turned legs: thigh below the hakama, knee and ankle balls, shin, tabi foot and split toes. */
import { Vector3 } from "three";
import { FINISH } from "../finish";
import type { GeometryBuilder } from "../geometry-builder";
import { jointPosition, SIDES, SOLE_HEIGHT_M } from "../standard-figure";
import { ball, curve, grid, lathe, ring, type Surface, signedPower } from "../surface";

const THIGH = [
  [0.5, 0.0005],
  [0.51, 0.1],
  [0.65, 0.122],
  [0.8, 0.098],
  [0.872, 0.089],
  [0.89, 0.097],
  [0.908, 0.097],
  [0.926, 0.084],
  [0.935, 0.0005],
];
const SHIN = [
  [0.06, 0.0005],
  [0.068, 0.084],
  [0.085, 0.099],
  [0.103, 0.1],
  [0.125, 0.094],
  [0.22, 0.116],
  [0.34, 0.13],
  [0.52, 0.108],
  [0.72, 0.074],
  [0.84, 0.062],
  [0.875, 0.06],
  [0.892, 0.07],
  [0.91, 0.07],
  [0.93, 0.056],
  [0.935, 0.0005],
];
const CUFF = [
  [0, 0.0005],
  [0.01, 0.46],
  [0.06, 0.505],
  [0.5, 0.5],
  [1, 0.6],
];

/** Sections of a foot: (z, centre offset from the ankle to the outside, half width, height of the instep). */
const FOOT = [
  [-0.13, 0, 0.001, 0.022],
  [-0.124, 0, 0.02, 0.036],
  [-0.105, 0, 0.033, 0.052],
  [-0.075, 0, 0.036, 0.072],
  [-0.035, 0.002, 0.036, 0.066],
  [0.005, 0.004, 0.04, 0.05],
  [0.033, 0.004, 0.043, 0.04],
  [0.041, 0.004, 0.041, 0.036],
  [0.0415, 0.004, 0.001, 0.01],
];
const BIG_TOE = [
  [0.04, -0.013, 0.001, 0.012],
  [0.0405, -0.0155, 0.019, 0.034],
  [0.075, -0.016, 0.0185, 0.029],
  [0.105, -0.015, 0.0165, 0.024],
  [0.122, -0.014, 0.01, 0.014],
  [0.127, -0.014, 0.0008, 0.004],
];
const OTHER_TOES = [
  [0.04, 0.02, 0.001, 0.012],
  [0.0405, 0.0225, 0.0235, 0.033],
  [0.07, 0.0235, 0.0225, 0.027],
  [0.098, 0.022, 0.018, 0.02],
  [0.111, 0.021, 0.01, 0.011],
  [0.115, 0.021, 0.0008, 0.002],
];

/** Return a flat-soled loft along z. */
function createFootPart(
  sections: readonly (readonly number[])[],
  centre: number,
  sign: number,
  columns: number,
  rows: number,
): Surface {
  const section = curve(sections);
  const [back, front] = [sections[0][0], sections[sections.length - 1][0]];
  return grid(
    (u, v) => {
      const z = back + (front - back) * v;
      const [lateral, half, top] = section(z);
      const [c, s] = [Math.cos(u * 2 * Math.PI), Math.sin(u * 2 * Math.PI)];
      const height = top + SOLE_HEIGHT_M;
      const y = -SOLE_HEIGHT_M + height * 0.36 + (s > 0 ? s ** 0.9 * height * 0.64 : -((-s) ** 0.45) * height * 0.36);
      return new Vector3(centre + lateral * sign + signedPower(c, 0.8) * half, y, z);
    },
    columns,
    rows,
  );
}

export function addLegs(builder: GeometryBuilder): void {
  for (const { side, sign } of SIDES) {
    const [hip, knee, ankle, midtarsal] = ["hip", "knee", "ankle", "midtarsal"].map((name) => `${side}_${name}`);
    const [hipAt, kneeAt, ankleAt] = [jointPosition(hip), jointPosition(knee), jointPosition(ankle)];
    const shinAxis = ankleAt.clone().sub(kneeAt);
    const thighAxis = kneeAt.clone().sub(hipAt);
    const [thigh, shin] = [thighAxis.length(), shinAxis.length()];

    builder.add(lathe(hipAt, kneeAt, THIGH, { widthScale: 0.98, depthScale: 1.02 }), hip, FINISH.limb);
    builder.add(ball(kneeAt, 0.0415, [0.96, 1, 1], 14), hip, FINISH.jointBall);
    const straight = lathe(kneeAt, ankleAt, SHIN, { widthScale: 0.94, depthScale: 1.06 });
    const calf: Surface = (detail) => {
      const mesh = straight(detail);
      for (let i = 0; i < mesh.positions.length; i += 3) {
        const t = (kneeAt.y - mesh.positions[i + 1]) / (kneeAt.y - ankleAt.y);
        mesh.positions[i + 2] -= 0.014 * Math.exp(-(((t - 0.33) / 0.2) ** 2));
      }
      return mesh;
    };
    builder.add(calf, knee, FINISH.limb);
    builder.add(ball(ankleAt, 0.029, [1, 1, 1], 10), knee, FINISH.jointBall);
    builder.add(ring(hipAt.clone().lerp(kneeAt, 0.899), thighAxis, 0.094 * thigh, 0.003), hip, FINISH.gold);
    builder.add(ring(kneeAt.clone().lerp(ankleAt, 0.094), shinAxis, 0.096 * shin, 0.003), knee, FINISH.gold);
    builder.add(ring(kneeAt.clone().lerp(ankleAt, 0.9), shinAxis, 0.0695 * shin, 0.0028), knee, FINISH.gold);

    builder.add(createFootPart(FOOT, ankleAt.x, sign, 14, 9), ankle, FINISH.tabi);
    const cuffTop = ankleAt.clone().add(new Vector3(0, 0.052, 0.001));
    const cuffEnd = ankleAt.clone().add(new Vector3(0, -0.02, 0.006));
    builder.add(lathe(cuffTop, cuffEnd, CUFF, { rows: 14 }), ankle, FINISH.tabi);
    builder.add(createFootPart(BIG_TOE, ankleAt.x, sign, 10, 7), midtarsal, FINISH.tabi);
    builder.add(createFootPart(OTHER_TOES, ankleAt.x, sign, 10, 7), midtarsal, FINISH.tabi);
  }
}
