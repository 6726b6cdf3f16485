/** Outline of the person before the camera: lines between the landmarks, as in a mirror. */
import { type DetectedBody, LANDMARK, LANDMARK_STRIDE, type LandmarkName, visibilityOf } from "../../webcam/landmark";

/** Lines of the outline: from the middle of the body outwards. */
const LINES: readonly (readonly LandmarkName[])[] = [
  ["leftWrist", "leftElbow", "leftShoulder", "rightShoulder", "rightElbow", "rightWrist"],
  ["leftShoulder", "leftHip", "rightHip", "rightShoulder"],
  ["leftHip", "leftKnee", "leftAnkle"],
  ["rightHip", "rightKnee", "rightAnkle"],
];
/** Visibility below which a landmark is not drawn. */
const MIN_VISIBILITY = 0.4;
/** Radius of the head in distances of the ears, which are seen from the front. */
const HEAD_RADIUS = 0.75;
/** Share of the way from the wrist to the knuckles at which the middle of the palm is. */
const PALM_SHARE = 0.8;

export type OutlinePoint = readonly [x: number, y: number];

/** Shapes of an outline, in a mirrored picture of the given size. */
export interface Outline {
  readonly lines: readonly (readonly OutlinePoint[])[];
  readonly head: { readonly at: OutlinePoint; readonly radius: number } | null;
  /** Middle of each palm; null if the hand is not seen. */
  readonly hands: { readonly left: OutlinePoint | null; readonly right: OutlinePoint | null };
}

/** Return the outline of a body in a mirrored picture of `width` and `height`. */
export function outlineOf({ image }: DetectedBody, width: number, height: number): Outline {
  const find = (name: LandmarkName): OutlinePoint => {
    const at = LANDMARK[name] * LANDMARK_STRIDE;
    return [(1 - image[at]) * width, image[at + 1] * height];
  };
  const isSeen = (name: LandmarkName) => visibilityOf(image, LANDMARK[name]) >= MIN_VISIBILITY;
  const [leftEar, rightEar] = [find("leftEar"), find("rightEar")];
  const findPalm = (side: "left" | "right"): OutlinePoint | null => {
    if (!isSeen(`${side}Wrist`)) return null;
    return mix(find(`${side}Wrist`), mix(find(`${side}Index`), find(`${side}Pinky`), 0.5), PALM_SHARE);
  };
  return {
    lines: LINES.flatMap((names) => splitSeen(names, isSeen)).map((names) => names.map(find)),
    head: isSeen("nose")
      ? {
          at: mix(leftEar, rightEar, 0.5),
          radius: Math.max(
            HEAD_RADIUS * Math.hypot(leftEar[0] - rightEar[0], leftEar[1] - rightEar[1]),
            // A head in profile.
            0.22 * Math.hypot(...subtract(find("leftShoulder"), find("rightShoulder"))),
          ),
        }
      : null,
    hands: { left: findPalm("left"), right: findPalm("right") },
  };
}

/** Return the parts of a line whose landmarks are all seen. */
function splitSeen(names: readonly LandmarkName[], isSeen: (name: LandmarkName) => boolean): LandmarkName[][] {
  const parts: LandmarkName[][] = [[]];
  for (const name of names) {
    if (isSeen(name)) parts.at(-1)?.push(name);
    else parts.push([]);
  }
  return parts.filter((part) => part.length > 1);
}

function mix(a: OutlinePoint, b: OutlinePoint, share: number): OutlinePoint {
  return [a[0] + (b[0] - a[0]) * share, a[1] + (b[1] - a[1]) * share];
}

function subtract(a: OutlinePoint, b: OutlinePoint): OutlinePoint {
  return [a[0] - b[0], a[1] - b[1]];
}
