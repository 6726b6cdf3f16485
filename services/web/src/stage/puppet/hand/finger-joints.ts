/** Joints of the puppet's fingers: three bones for each, in the order of the chains of `motion/hands.ts`. */
import { Vector3 } from "three";
import { jointPosition, SIDES } from "../standard-figure";

// Those of `motion/hands.ts` load later.
const FINGERS = ["thumb", "index", "middle", "ring", "little"];
/** Segments of each finger. */
export const SEGMENTS = 3;

/** Three points on a finger of the standard figure, from the wrist: x away from the body, y up, z to the front. */
type FingerLine = readonly [root: Triple, middle: Triple, tip: Triple];
type Triple = readonly [x: number, y: number, z: number];

const THUMB: FingerLine = [
  [-0.002, -0.034, 0.026],
  [-0.01, -0.066, 0.047],
  [-0.014, -0.094, 0.053],
];
/** Fingers, index to little: (y and z of the knuckle, length, curl towards the palm). */
const FINGER_SIZES = [
  [-0.092, 0.0268, 0.076, 0.012],
  [-0.096, 0.0098, 0.086, 0.014],
  [-0.096, -0.0075, 0.083, 0.017],
  [-0.092, -0.0245, 0.07, 0.02],
];
/** Joints and tip as shares of the line from root to tip. */
const SHARES = [0, 0.44, 0.74, 1];

/** Names of the bones: those of chain c are at 3 c, from the wrist outwards. */
export const FINGER_BONES: readonly string[] = SIDES.flatMap(({ side }) =>
  FINGERS.flatMap((finger) => [1, 2, 3].map((number) => `${side}_${finger}_${number}`)),
);

/** Return the wrist that carries a finger's bone. */
export function wristOf(bone: string): string {
  return `${bone[0]}_wrist`;
}

/** Return the joints and the tip of each chain on the standard figure. */
export function fingerJoints(): Vector3[][] {
  return SIDES.flatMap(({ side, sign }) => {
    const wrist = jointPosition(`${side}_wrist`);
    return handLines().map((line) =>
      SHARES.map((share) => {
        const [x, y, z] = pointOn(line, share);
        return new Vector3(sign * x, y, z).add(wrist);
      }),
    );
  });
}

function handLines(): FingerLine[] {
  return [
    THUMB,
    ...FINGER_SIZES.map(
      ([knuckle, z, length, curl]): FingerLine => [
        [0.003, knuckle, z + 0.006],
        [0.002 - curl * 0.35, -0.096 - length * 0.5, z * 1.02 + 0.006],
        [-curl * 1.15, -0.096 - length * 0.95, z * 0.98 + 0.005],
      ],
    ),
  ];
}

/** Return a point of the parabola through the three points of a line. */
function pointOn([root, middle, tip]: FingerLine, t: number): number[] {
  return root.map(
    (a, axis) => a * (1 - t) * (1 - 2 * t) + middle[axis] * 4 * t * (1 - t) + tip[axis] * t * (2 * t - 1),
  );
}
