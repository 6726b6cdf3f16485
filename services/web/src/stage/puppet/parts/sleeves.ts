/** Kimono sleeves: a solid of revolution over the upper arm, and a bag that hangs from it on its own bone. */
import { Vector3 } from "three";
import { FINISH } from "../finish";
import type { GeometryBuilder, VertexWeights } from "../geometry-builder";
import { jointPosition, SIDES } from "../standard-figure";
import { grid, lathe, ring, signedPower, smoothStep } from "../surface";

const SLEEVE = [
  [0, 0.0005],
  [0.004, 0.075],
  [0.03, 0.14],
  [0.09, 0.178],
  [0.2, 0.192],
  [0.45, 0.198],
  [0.7, 0.222],
  [0.86, 0.244],
  [0.9, 0.248],
];
const LINING = [
  [0.5, 0.19],
  [0.86, 0.237],
  [0.9, 0.243],
];
/** The bag, in metres: extent along the arm, how far it hangs, corner radius, half thickness at the arm. */
const BAG = { from: 0.075, to: 0.285, hang: 0.31, corner: 0.075, thick: 0.05 };

/** Return the directions of the bag in the bind pose: down the arm, the way it hangs, across. */
export function sleeveBindAxes(side: "l" | "r"): { along: Vector3; hang: Vector3; across: Vector3 } {
  const along = jointPosition(`${side}_elbow`)
    .sub(jointPosition(`${side}_shoulder`))
    .normalize();
  return { along, hang: new Vector3(0, 0, -1), across: new Vector3(side === "l" ? 1 : -1, 0, 0) };
}

export function addSleeves(builder: GeometryBuilder): void {
  for (const { side, sign } of SIDES) {
    const top = jointPosition(`${side}_shoulder`).add(new Vector3(-sign * 0.01, 0.05, 0));
    const elbow = jointPosition(`${side}_elbow`);
    const axis = elbow.clone().sub(top);
    const weights: VertexWeights = ({ y }) => {
      const arm = smoothStep(1.475, 1.37, y);
      return [
        [`${side}_clavicle`, (1 - arm) * 0.55],
        [`${side}_shoulder`, 0.45 + 0.55 * arm],
      ];
    };
    const shape = { widthScale: 0.92, depthScale: 1.06, columns: 22 };
    builder.add(
      lathe(top, elbow, SLEEVE, { ...shape, rows: 13, uv: (u, v) => [u * 0.42, v * 0.31] }),
      weights,
      FINISH.kimono,
    );
    builder.add(lathe(top, elbow, LINING, { ...shape, rows: 2 }), `${side}_shoulder`, FINISH.lining, true);
    builder.add(
      ring(top.clone().lerp(elbow, 0.9), axis, 0.247 * axis.length(), 0.0036, 0.92, 1.06),
      `${side}_shoulder`,
      FINISH.piping,
    );
    addBag(builder, side);
  }
}

function addBag(builder: GeometryBuilder, side: "l" | "r"): void {
  const shoulder = jointPosition(`${side}_shoulder`);
  const { along, hang, across } = sleeveBindAxes(side);
  const at = (angle: number, fall: number): Vector3 => {
    const round = Math.max(0, fall - (BAG.hang - BAG.corner));
    const cut = BAG.corner - Math.sqrt(Math.max(0, BAG.corner ** 2 - round ** 2));
    const [from, to] = [BAG.from + cut, BAG.to - cut * 0.25];
    const place = signedPower(Math.cos(angle), 0.5);
    const low = fall / BAG.hang;
    const thick = Math.sin(angle) * BAG.thick * (1 - 0.93 * low * low) + 0.007 * Math.sin(place * 4.2 + 0.8) * low;
    return shoulder
      .clone()
      .addScaledVector(along, (from + to) / 2 + ((to - from) / 2) * place)
      .addScaledVector(hang, fall - 0.015)
      .addScaledVector(across, thick);
  };
  const bone = `${side}_sleeve`;
  builder.add(
    grid(
      (u, v) => at(u * 2 * Math.PI, v * BAG.hang),
      26,
      7,
      (_u, _v, p) => [p.y, p.z],
    ),
    bone,
    FINISH.kimono,
  );
  const piping = grid(
    (u, v) => {
      const b = v * 2 * Math.PI;
      return at(u * 2 * Math.PI, BAG.hang)
        .addScaledVector(hang, 0.0032 * Math.sin(b))
        .addScaledVector(across, 0.0032 * Math.cos(b));
    },
    26,
    4,
  );
  builder.add(piping, bone, FINISH.piping);
}
