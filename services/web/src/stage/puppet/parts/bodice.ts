/** The kimono's bodice with its crossed collars, and the obi with cord and knot. */
import { CatmullRomCurve3, Vector3 } from "three";
import { FINISH, type Finish } from "../finish";
import type { GeometryBuilder, VertexWeights } from "../geometry-builder";
import { jointPosition, SIDES } from "../standard-figure";
import { ball, box, capsule, curve, grid, loft, signedPower, smoothStep } from "../surface";

/** Sections (y, centre z, half width, half depth, power). */
const BODICE = [
  [1.02, -0.036, 0.118, 0.094, 2.2],
  [1.08, -0.038, 0.124, 0.096, 2.2],
  [1.15, -0.04, 0.136, 0.104, 2.3],
  [1.23, -0.04, 0.154, 0.116, 2.4],
  [1.31, -0.038, 0.178, 0.121, 2.5],
  [1.375, -0.037, 0.204, 0.114, 2.6],
  [1.425, -0.035, 0.222, 0.102, 2.6],
  [1.456, -0.033, 0.222, 0.088, 2.5],
  [1.48, -0.03, 0.198, 0.078, 2.3],
  [1.497, -0.026, 0.156, 0.07, 2.1],
  [1.508, -0.021, 0.11, 0.062, 2],
  [1.514, -0.018, 0.074, 0.054, 2],
];
const OBI = [
  [1.012, -0.034, 0.125, 0.098, 2.25],
  [1.016, -0.034, 0.1355, 0.1085, 2.25],
  [1.045, -0.036, 0.1335, 0.107, 2.25],
  [1.095, -0.039, 0.1345, 0.107, 2.25],
  [1.118, -0.04, 0.1395, 0.1105, 2.25],
  [1.122, -0.04, 0.126, 0.099, 2.25],
];

/** Blend of the trunk above the waist, from its lowest joint to the chest, and to the clavicles at the shoulders. */
export const trunkWeights: VertexWeights = (at) => {
  const chest = smoothStep(1.09, 1.33, at.y);
  const clavicle = smoothStep(0.05, 0.16, Math.abs(at.x)) * smoothStep(1.3, 1.42, at.y);
  return [
    ["vl5", 1 - chest],
    ["chest", chest * (1 - clavicle)],
    [at.x > 0 ? "l_clavicle" : "r_clavicle", chest * clavicle],
  ];
};

/** Blend from the hips up to the chest. */
export const waistWeights: VertexWeights = ({ y }) => {
  const chest = smoothStep(0.98, 1.09, y);
  return [
    ["vl5", chest],
    ["sacroiliac", 1 - chest],
  ];
};

/** Weights of the waist; the yoke also follows the arms a little. */
const yokeWeights: VertexWeights = (at) => {
  const arm = smoothStep(0.13, 0.215, Math.abs(at.x)) * smoothStep(1.3, 1.42, at.y) * 0.45;
  const chest = smoothStep(0.98, 1.09, at.y);
  return [
    ["sacroiliac", 1 - chest],
    [at.x > 0 ? "l_shoulder" : "r_shoulder", arm],
    ...trunkWeights(at).map(([bone, weight]) => [bone, weight * chest * (1 - arm)] as const),
  ];
};

const section = curve(BODICE);

/** Return the z of the bodice's front at x, y. */
function frontDepth(x: number, y: number): number {
  const [centre, wide, deep, power] = section(Math.min(y, 1.512));
  const lateral = Math.min(0.985, Math.abs(x) / wide);
  return centre + deep * (1 - lateral ** power) ** (1 / power);
}

export function addBodice(builder: GeometryBuilder): void {
  builder.add(loft(BODICE, 32, 16), yokeWeights, FINISH.kimono);
  for (const { side } of SIDES)
    builder.add(ball(jointPosition(`${side}_shoulder`), 0.052, [1, 1, 1], 14), trunkWeights, FINISH.kimono);
  builder.add(
    grid(
      (u, v) => {
        const y = 1.36 + v * 0.155;
        const x = (u - 0.5) * 2 * (0.012 + 0.058 * smoothStep(0, 0.8, v));
        return new Vector3(x, y, frontDepth(x, y) + 0.002);
      },
      10,
      12,
    ),
    trunkWeights,
    FINISH.throat,
  );
  // White inner pair first. In the outer pair the left lies over the right, as the living wear it.
  for (const sign of [-1, 1]) addCollar(builder, sign, 0.036, sign < 0 ? 0.005 : 0.007, FINISH.innerCollar, 0.018, 0.7);
  for (const sign of [-1, 1]) addCollar(builder, sign, 0.05, sign < 0 ? 0.0085 : 0.0125, FINISH.collar, -0.007, 1);
  addObi(builder);
}

/**
 * Add a band from the nape over one shoulder, crossing to the far side of the obi; `inset` moves it towards the neck.
 */
function addCollar(
  builder: GeometryBuilder,
  sign: number,
  width: number,
  lift: number,
  finish: Finish,
  inset: number,
  end: number,
): void {
  const path = [
    new Vector3(0, 1.534, -0.072 + inset * 0.6),
    new Vector3(sign * (0.042 - inset * 0.5), 1.532, -0.06 + inset * 0.5),
    new Vector3(sign * (0.068 - inset * 0.8), 1.526 - inset * 0.2, -0.02),
    new Vector3(sign * (0.068 - inset * 0.9), 1.506 - inset * 0.5, 0.022),
    new Vector3(sign * (0.06 - inset * 0.9), 1.468, 0.05),
  ];
  const crossing = [
    [0.04 - inset * 0.9, 1.42],
    [0.01 - inset * 0.9, 1.365],
    [-0.026 - inset * 0.9, 1.29],
    [-0.06 - inset * 0.6, 1.2],
    [-0.084 - inset * 0.3, 1.105],
  ];
  for (const [x, y] of crossing) path.push(new Vector3(sign * x, y, frontDepth(sign * x, y) + 0.002));
  const line = new CatmullRomCurve3(path, false, "centripetal");
  builder.add(
    grid(
      (u, v) => {
        const t = Math.min(1, Math.max(0, u)) * end;
        const at = line.getPoint(t);
        const onChest = smoothStep(0.3, 0.55, t);
        const out = new Vector3(
          at.x * (1 - onChest * 0.6),
          0.3 * (1 - onChest),
          at.z + 0.03 + onChest * 0.06,
        ).normalize();
        const across = line.getTangent(t).cross(out).normalize();
        const angle = v * 2 * Math.PI;
        const thick = signedPower(Math.sin(angle), 0.6) * 0.0032;
        at.addScaledVector(across, -sign * signedPower(Math.cos(angle), 0.35) * width * 0.5).addScaledVector(
          out,
          lift + thick,
        );
        at.z += onChest * (frontDepth(at.x, Math.max(at.y, 1.06)) + lift + 0.001 + thick - at.z);
        return at;
      },
      20,
      6,
      (u, v) => [v * 0.1, u * 0.5],
    ),
    trunkWeights,
    finish,
  );
}

function addObi(builder: GeometryBuilder): void {
  builder.add(loft(OBI, 34, 6), waistWeights, FINISH.obi);
  builder.add(
    grid(
      (u, v) => {
        const [a, b] = [u * 2 * Math.PI, v * 2 * Math.PI];
        const thick = 0.005 * Math.cos(b);
        const x = signedPower(Math.sin(a), 2 / 2.25) * (0.1355 + thick);
        return new Vector3(
          x,
          1.068 + 0.005 * Math.sin(b),
          -0.037 + signedPower(Math.cos(a), 2 / 2.25) * (0.1085 + thick),
        );
      },
      30,
      4,
    ),
    waistWeights,
    FINISH.cord,
  );
  builder.add(ball(new Vector3(0, 1.068, 0.076), 0.0105, [1.3, 0.8, 1], 10), waistWeights, FINISH.cord);
  builder.add(
    capsule(new Vector3(0.006, 1.066, 0.079), new Vector3(0.017, 1.012, 0.084), 0.0046, 0.0038),
    waistWeights,
    FINISH.cord,
  );
  builder.add(
    capsule(new Vector3(-0.006, 1.066, 0.079), new Vector3(-0.012, 1.02, 0.084), 0.0046, 0.0038),
    waistWeights,
    FINISH.cord,
  );
  builder.add(box(new Vector3(0, 1.085, -0.157), [0.15, 0.06, 0.024], 0.34), "sacroiliac", FINISH.obiPlain);
  builder.add(box(new Vector3(0, 1.07, -0.163), [0.055, 0.085, 0.028], -0.25), "sacroiliac", FINISH.obiPlain);
}
