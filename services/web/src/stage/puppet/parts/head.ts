/** Neck, carved head, ears, hair and the folded topknot (mage). */
import { Vector3 } from "three";
import { FINISH } from "../finish";
import type { GeometryBuilder, VertexWeights } from "../geometry-builder";
import { HEAD_CENTRE } from "../standard-figure";
import { ball, curve, grid, lathe, ring, smoothStep, tube } from "../surface";

const NECK = [
  [0, 0.0005],
  [0.01, 0.3],
  [0.35, 0.31],
  [0.7, 0.34],
  [0.95, 0.43],
  [1, 0.46],
];
/** Hairline: angle from the crown by azimuth from the front, in radians. */
const HAIRLINE = [
  [0, 0.8],
  [0.35, 0.84],
  [0.62, 1.02],
  [0.84, 1.3],
  [1.02, 1.66],
  [1.25, 1.62],
  [1.55, 1.56],
  [1.9, 1.95],
  [2.5, 2.22],
  [3.15, 2.26],
];
const TOPKNOT = [
  [0, 0.012],
  [0.18, 0.0135],
  [0.3, 0.015],
  [0.55, 0.0185],
  [0.85, 0.0175],
  [0.96, 0.012],
  [1, 0.0005],
];
const RADII = new Vector3(0.0745, 0.121, 0.094);
/** The puppet's head is slightly larger than life, enlarged about the chin. */
const HEAD_SCALE = 1.07;

/** Reliefs of the mask: (x, y, half width, half height, depth); a non-zero x is mirrored. */
const RELIEFS = [
  [0.0105, -0.0245, 0.006, 0.006, 0.0022],
  [0.0285, 0.006, 0.0165, 0.0125, -0.0062],
  [0.027, 0.006, 0.0105, 0.0055, 0.0035],
  [0.024, 0.029, 0.02, 0.007, 0.0035],
  [0, -0.0545, 0.0135, 0.006, 0.0032],
  [0, -0.0645, 0.011, 0.005, 0.0036],
  [0, -0.0592, 0.016, 0.0026, -0.0012],
  [0, -0.092, 0.018, 0.014, 0.004],
  [0, -0.077, 0.018, 0.006, -0.0025],
  [0.04, -0.028, 0.02, 0.02, 0.003],
];

function gaussianBump(x: number, y: number, cx: number, cy: number, rx: number, ry: number): number {
  return Math.exp(-(((x - cx) / rx) ** 2 + ((y - cy) / ry) ** 2));
}

/** Return the point of the head in a direction of the unit sphere. */
function headPoint(direction: Vector3): Vector3 {
  const jaw = Math.max(0, -direction.y);
  const front = direction.z > 0;
  const wide = RADII.x * (1 - 0.36 * jaw ** 1.7) * (1 + 0.03 * direction.y);
  const deep = RADII.z * (front ? 1 - 0.1 * jaw ** 2 : 1 - 0.42 * jaw ** 1.3);
  const [x, y] = [direction.x * wide, direction.y * RADII.y];
  let z = direction.z * deep;
  if (front) {
    z += 0.006 * jaw * direction.z - 0.012 * direction.z ** 4;
    const bridge = y - 0.002;
    z += 0.015 * Math.exp(-((x / 0.0098) ** 2)) * smoothStep(0.032, -0.024, bridge) * smoothStep(-0.04, -0.025, bridge);
    for (const [cx, cy, rx, ry, depth] of RELIEFS) {
      z += depth * gaussianBump(x, y, cx, cy, rx, ry);
      if (cx > 0) z += depth * gaussianBump(x, y, -cx, cy, rx, ry);
    }
  }
  return new Vector3(x * HEAD_SCALE, (y + 0.11) * HEAD_SCALE - 0.11, z * HEAD_SCALE).add(HEAD_CENTRE);
}

function sphereDirection(azimuth: number, fall: number): Vector3 {
  return new Vector3(Math.sin(azimuth) * Math.sin(fall), Math.cos(fall), Math.cos(azimuth) * Math.sin(fall));
}

/** Blend from the chest up to the neck. */
const neckWeights: VertexWeights = ({ y }) => {
  const neck = smoothStep(1.47, 1.55, y);
  return [
    ["chest", 1 - neck],
    ["neck", neck],
  ];
};

export function addHead(builder: GeometryBuilder): void {
  builder.add(
    lathe(new Vector3(0.002, 1.575, 0.012), new Vector3(0.001, 1.44, -0.02), NECK, { rows: 14 }),
    neckWeights,
    FINISH.gofun,
  );
  builder.add(
    grid(
      (u, v) => {
        // Columns are denser at the front and rows at the features, where the mask needs them.
        const q = 2 * u - 1;
        const azimuth = ((q + 1.8 * q ** 3) / 2.8) * Math.PI;
        const fall = Math.min(1, Math.max(0, v - 0.055 * Math.sin(2 * Math.PI * (v - 0.02)))) * Math.PI;
        return headPoint(sphereDirection(azimuth, fall));
      },
      38,
      40,
    ),
    "skullbase",
    FINISH.face,
  );
  for (const sign of [1, -1]) {
    builder.add(
      ball(new Vector3(0.002 + sign * 0.0775, 1.628, 0.01), 0.017, [0.42, 1.25, 0.85], 10),
      "skullbase",
      FINISH.gofun,
    );
  }
  addHair(builder);
}

function addHair(builder: GeometryBuilder): void {
  const line = curve(HAIRLINE);
  builder.add(
    grid(
      (u, v) => {
        const azimuth = ((((u % 1) + 1) % 1) - 0.5) * 2 * Math.PI;
        const away = Math.abs(azimuth);
        const toward = sphereDirection(azimuth, Math.max(v, 1e-3) * line(away)[0]);
        const out = toward.clone().divide(RADII).normalize();
        const edge = smoothStep(1, 0.86, v);
        const fullness =
          smoothStep(0.55, 1.15, away) * smoothStep(2.6, 1.5, away) * Math.sin(Math.PI * Math.min(1, v * 0.95));
        const combed = 0.0007 * Math.sin(azimuth * 14) * smoothStep(0.2, 0.6, v);
        return headPoint(toward).addScaledVector(out, edge * (0.0135 + 0.011 * fullness + combed) - 0.0015);
      },
      48,
      9,
    ),
    "skullbase",
    FINISH.hair,
  );
  const fold = [
    [1.745, -0.058],
    [1.79, -0.058],
    [1.815, -0.034],
    [1.81, 0.002],
    [1.793, 0.026],
  ];
  builder.add(
    tube(
      fold.map(([y, z]) => new Vector3(0.002, y, z)),
      TOPKNOT,
      [1.15, 0.8, 0.9],
    ),
    "skullbase",
    FINISH.hair,
  );
  builder.add(
    ring(new Vector3(0.002, 1.777, -0.06), new Vector3(0, 1, 0.12), 0.0135, 0.0046),
    "skullbase",
    FINISH.hairTie,
  );
}
