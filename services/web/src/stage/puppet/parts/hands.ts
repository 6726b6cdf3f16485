/** Gofun hands: a palm towards the body, four fingers and a thumb of three carved segments each. */
import { Quaternion, Vector3 } from "three";
import { FINISH } from "../finish";
import type { GeometryBuilder } from "../geometry-builder";
import { FINGER_BONES, fingerJoints, SEGMENTS } from "../hand/finger-joints";
import { jointPosition, SIDES } from "../standard-figure";
import { curve, grid, type Surface, signedPower } from "../surface";

/** Palm: (position, half thickness, half width). */
const PALM_SECTIONS = [
  [0, 1e-5, 1e-5],
  [0.05, 0.016, 0.013],
  [0.25, 0.019, 0.02],
  [0.55, 0.0215, 0.034],
  [0.85, 0.0175, 0.0385],
  [0.97, 0.012, 0.034],
  [1, 1e-5, 1e-5],
];
/** Radii at the joints and the tip, in metres. */
const THUMB_RADII = [0.0115, 0.0102, 0.0092, 0.007];
const FINGER_RADII = [0.0088, 0.0084, 0.0077, 0.0062];
/** Radius behind a joint, as a share of that of the round end before it. */
const NECK = 0.92;

const DOWN = new Vector3(0, -1, 0);

export function addHands(builder: GeometryBuilder): void {
  for (const { side, sign } of SIDES) {
    const wrist = `${side}_wrist`;
    builder.add(createPalm(jointPosition(wrist), sign), wrist, FINISH.hand);
  }
  fingerJoints().forEach((joints, chain) => {
    const radii = chain % 5 === 0 ? THUMB_RADII : FINGER_RADII;
    for (let place = 0; place < SEGMENTS; place++) {
      const segment = createSegment(joints[place], joints[place + 1], radii[place], radii[place + 1]);
      builder.add(segment, FINGER_BONES[chain * SEGMENTS + place], FINISH.hand);
    }
  });
}

function createPalm(wrist: Vector3, sign: number): Surface {
  const section = curve(PALM_SECTIONS);
  return grid(
    (u, v) => {
      const [thick, half] = section(v);
      const angle = u * 2 * Math.PI;
      const x = 0.003 + signedPower(Math.sin(angle), 0.8) * thick * 0.8;
      return new Vector3(sign * x, -0.016 - 0.088 * v, 0.006 * v + signedPower(Math.cos(angle), 0.9) * half).add(wrist);
    },
    14,
    9,
  );
}

/**
 * Return a carved segment: thinner behind its joint than the round end before it. Round ends stay closed where joints
 * bend.
 */
function createSegment(from: Vector3, to: Vector3, radius: number, endRadius: number): Surface {
  const axis = to.clone().sub(from);
  const length = axis.length();
  const turn = new Quaternion().setFromUnitVectors(DOWN, axis.divideScalar(length));
  const start = NECK * radius;
  const rings = [
    [-start, 0],
    [-0.55 * start, 0.83 * start],
    [0.1 * length, start],
    [length, endRadius],
    [length + 0.6 * endRadius, 0.8 * endRadius],
    [length + endRadius, 0],
  ];
  const rows = rings.length - 1;
  return grid(
    (u, v) => {
      const ring = Math.min(Math.floor(v * rows), rows - 1);
      const share = v * rows - ring;
      const [along, wide] = rings[ring].map((value, i) => value + share * (rings[ring + 1][i] - value));
      const angle = u * 2 * Math.PI;
      return new Vector3(Math.sin(angle) * wide, -along, Math.cos(angle) * wide).applyQuaternion(turn).add(from);
    },
    7,
    rows,
  );
}
