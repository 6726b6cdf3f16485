/** The hakama, hitched above the knee: a pleated tube per leg, lined vermilion, under a white cord with a bow. */
import { Vector3 } from "three";
import { FINISH } from "../finish";
import type { GeometryBuilder, VertexWeights } from "../geometry-builder";
import { SIDES } from "../standard-figure";
import { box, curve, grid, loft, signedPower, smoothStep } from "../surface";
import { waistWeights } from "./bodice";

const HEM_HEIGHT_M = 0.545;
const TOP_HEIGHT_M = 1.034;
/** Sections (y, centre x of the left leg, centre z, half width, half depth, power). */
const LEG = [
  [HEM_HEIGHT_M, 0.115, 0.02, 0.122, 0.142, 2.3],
  [0.6, 0.113, 0.016, 0.12, 0.139, 2.3],
  [0.7, 0.106, 0.008, 0.115, 0.134, 2.3],
  [0.8, 0.094, -0.002, 0.108, 0.129, 2.3],
  [0.88, 0.08, -0.01, 0.1, 0.123, 2.3],
  [0.945, 0.064, -0.018, 0.09, 0.112, 2.25],
  [0.985, 0.056, -0.025, 0.079, 0.096, 2.2],
  [1.01, 0.05, -0.03, 0.07, 0.086, 2.2],
  [1.03, 0.045, -0.033, 0.064, 0.08, 2.2],
];
const BAND = [
  [0.984, -0.031, 0.13, 0.101, 2.25],
  [0.987, -0.031, 0.1485, 0.1195, 2.25],
  [1.015, -0.033, 0.1455, 0.117, 2.25],
  [1.019, -0.034, 0.124, 0.098, 2.25],
];

const section = curve(LEG);

/** Return the saw-tooth profile of a knife pleat, 0..1. */
function pleatDepth(x: number): number {
  const t = ((x % 1) + 1) % 1;
  return smoothStep(0, 0.82, t) * smoothStep(1, 0.86, t);
}

function clothPoint(u: number, y: number, lift: number, sign: number): Vector3 {
  const [cx, cz, wide, deep, power] = section(y);
  const angle = u * 2 * Math.PI;
  const [s, c] = [Math.sin(angle), Math.cos(angle)];
  const low = smoothStep(0.99, 0.6, y);
  const facing = smoothStep(-0.2, 0.55, c);
  const outside = (angle > Math.PI ? angle - 2 * Math.PI : angle) * sign;
  const knife =
    (pleatDepth(outside * 1.75 + 0.3) - 0.45) * 0.018 * facing * (0.35 + 0.65 * low) * smoothStep(1, 0.93, y);
  const fold = knife + Math.sin(angle * 6 + 1) * 0.006 * (1 - facing) * low;
  return new Vector3(
    sign * cx + signedPower(s, 2 / power) * (wide + fold * 0.4 + lift),
    y,
    cz + signedPower(c, 2 / power) * (deep + fold + lift),
  );
}

export function addHakama(builder: GeometryBuilder): void {
  for (const { side, sign } of SIDES) {
    const weights: VertexWeights = ({ y }) => {
      const leg = smoothStep(0.985, 0.8, y);
      return [
        ["sacroiliac", 1 - leg],
        [`${side}_hip`, leg],
      ];
    };
    builder.add(
      grid(
        (u, v) => clothPoint(u, HEM_HEIGHT_M + (TOP_HEIGHT_M - HEM_HEIGHT_M) * v, 0, sign),
        46,
        9,
        (u, _v, at) => [u * 0.95, at.y],
      ),
      weights,
      FINISH.hakama,
    );
    builder.add(
      grid((u, v) => clothPoint(u, HEM_HEIGHT_M + 0.16 * v, -0.007, sign), 32, 1),
      weights,
      FINISH.lining,
      true,
    );
    const piping = grid(
      (u, v) =>
        clothPoint(
          u,
          HEM_HEIGHT_M + 0.0035 * Math.sin(v * 2 * Math.PI),
          -0.0035 + 0.0036 * Math.cos(v * 2 * Math.PI),
          sign,
        ),
      46,
      4,
    );
    builder.add(piping, weights, FINISH.piping);
  }
  builder.add(loft(BAND, 30, 4), waistWeights, FINISH.whiteCord);
  const bow: VertexWeights = ({ y }) => {
    const legs = smoothStep(0.985, 0.8, y) * 0.25;
    return [
      ["sacroiliac", 1 - 2 * legs],
      ["l_hip", legs],
      ["r_hip", legs],
    ];
  };
  builder.add(createCordTail(new Vector3(0.012, 1, 0.098), new Vector3(0.026, 0.78, 0.156)), bow, FINISH.whiteCord);
  builder.add(createCordTail(new Vector3(-0.012, 1, 0.1), new Vector3(-0.018, 0.82, 0.154)), bow, FINISH.whiteCord);
  builder.add(box(new Vector3(0.034, 1.003, 0.096), [0.06, 0.03, 0.016], 0.3), "sacroiliac", FINISH.whiteCord);
  builder.add(box(new Vector3(-0.034, 1.003, 0.096), [0.06, 0.03, 0.016], -0.3), "sacroiliac", FINISH.whiteCord);
  builder.add(box(new Vector3(0, 1.002, 0.1), [0.024, 0.03, 0.022], 0), "sacroiliac", FINISH.whiteCord);
  builder.add(box(new Vector3(0, 1.01, -0.148), [0.1, 0.085, 0.014], 0), "sacroiliac", FINISH.hakamaPlain);
}

/** Return a flat end of the cord, 22 mm wide and a little wider at the tip. */
function createCordTail(from: Vector3, to: Vector3) {
  return grid(
    (u, v) => {
      const angle = u * 2 * Math.PI;
      const at = from.clone().lerp(to, v);
      at.x += signedPower(Math.cos(angle), 0.3) * 0.011 * (1 + 0.25 * v);
      at.z += Math.sin(angle) * 0.004;
      return at;
    },
    10,
    5,
  );
}
