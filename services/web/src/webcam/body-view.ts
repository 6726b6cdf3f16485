/** A person as a picture shows them: arms, hips and feet. Pure. */
import { type DetectedBody, LANDMARK, LANDMARK_STRIDE, visibilityOf } from "./landmark";

export type Side = "left" | "right";
export const SIDES: readonly Side[] = ["left", "right"];

/** Focal length of a webcam in heights of its picture: a vertical field of view of 45 degrees. */
export const FOCAL_LENGTH = 1.2;

/** Point of the picture: x to its right and y upwards from its centre, in heights of the picture. */
export interface PicturePoint {
  readonly x: number;
  readonly y: number;
}

/** Point of the picture, and how much nearer to the camera it is than the shoulder, in metres of the model. */
export interface ViewPoint extends PicturePoint {
  readonly nearer: number;
}

export interface ArmView {
  readonly shoulder: ViewPoint;
  readonly elbow: ViewPoint;
  readonly wrist: ViewPoint;
  /** Middle of the palm. */
  readonly hand: ViewPoint;
  /** Visibility of the shoulder, 0 to 1. */
  readonly shoulderVisibility: number;
  /** Visibility of the wrist; zero if it is outside the picture, where the model only guesses. */
  readonly wristVisibility: number;
  /** Smallest visibility of elbow and wrist; zero if one is outside the picture. */
  readonly armVisibility: number;
}

export interface BodyView {
  readonly left: ArmView;
  readonly right: ArmView;
  /** Heights of the picture per metre of the model, at the distance of the shoulders, by their width. */
  readonly scale: number;
  /** Middle of the hips; null if one is not seen. */
  readonly hips: PicturePoint | null;
  /** Height of the lower ankle in the picture, as `PicturePoint.y`; null if an ankle is not seen. */
  readonly lowerAnkle: number | null;
  /** Length of the trunk from shoulders to hips in heights of the picture; null if a hip is not seen. */
  readonly trunk: number | null;
  /** Distance of the shoulders in metres of the model. */
  readonly shoulderWidth: number;
}

/** Margin of the picture in which the model guesses, in its widths or heights. */
const EDGE = 0.01;
/** Share of the way from the wrist to the knuckles at which the middle of the palm is. */
const PALM_SHARE = 0.8;
/** Smallest distance of the shoulders in the picture's plane for a scale, in metres of the model. */
const MIN_WIDTH_M = 0.05;
/** Visibility that hips and ankles need. */
const MIN_LEG_VISIBILITY = 0.6;

/** Return the arms in a picture whose width is `aspect` heights; null if the shoulders are one behind the other. */
export function viewBody(body: DetectedBody, aspect: number): BodyView | null {
  const { world } = body;
  const [l, r] = [LANDMARK.leftShoulder * LANDMARK_STRIDE, LANDMARK.rightShoulder * LANDMARK_STRIDE];
  const across = [0, 1, 2].map((axis) => world[l + axis] - world[r + axis]);
  const flatWidth = Math.hypot(across[0], across[1]);
  if (!(flatWidth > MIN_WIDTH_M)) return null;
  const [left, right] = SIDES.map((side) => viewArm(body, side, aspect));
  const pictured = Math.hypot(left.shoulder.x - right.shoulder.x, left.shoulder.y - right.shoulder.y);
  const hips = viewPair(body, LANDMARK.leftHip, LANDMARK.rightHip, aspect);
  const ankles = viewPair(body, LANDMARK.leftAnkle, LANDMARK.rightAnkle, aspect);
  const middle = hips && { x: (hips[0].x + hips[1].x) / 2, y: (hips[0].y + hips[1].y) / 2 };
  return {
    left,
    right,
    scale: pictured / flatWidth,
    hips: middle,
    lowerAnkle: ankles && Math.min(ankles[0].y, ankles[1].y),
    trunk:
      middle &&
      Math.hypot(
        (left.shoulder.x + right.shoulder.x) / 2 - middle.x,
        (left.shoulder.y + right.shoulder.y) / 2 - middle.y,
      ),
    shoulderWidth: Math.hypot(...across),
  };
}

/** Return two landmarks of the legs; null if one is not seen. */
function viewPair(
  { image }: DetectedBody,
  left: number,
  right: number,
  aspect: number,
): [PicturePoint, PicturePoint] | null {
  if (Math.min(visibilityInPicture(image, left), visibilityInPicture(image, right)) < MIN_LEG_VISIBILITY) return null;
  return [pointInPicture(image, left, aspect), pointInPicture(image, right, aspect)];
}

function pointInPicture(image: Float64Array, landmark: number, aspect: number): PicturePoint {
  const at = landmark * LANDMARK_STRIDE;
  return { x: (image[at] - 0.5) * aspect, y: 0.5 - image[at + 1] };
}

/** Return the visibility of a landmark; zero if it is outside the picture. */
function visibilityInPicture(image: Float64Array, landmark: number): number {
  const [x, y] = image.subarray(landmark * LANDMARK_STRIDE);
  const isInside = x > EDGE && x < 1 - EDGE && y > EDGE && y < 1 - EDGE;
  return isInside ? visibilityOf(image, landmark) : 0;
}

function viewArm({ image, world }: DetectedBody, side: Side, aspect: number): ArmView {
  const shoulderDepth = world[LANDMARK[`${side}Shoulder`] * LANDMARK_STRIDE + 2];
  const find = (landmark: number): ViewPoint => ({
    ...pointInPicture(image, landmark, aspect),
    nearer: shoulderDepth - world[landmark * LANDMARK_STRIDE + 2],
  });
  const seen = (landmark: number) => visibilityInPicture(image, landmark);
  const wrist = find(LANDMARK[`${side}Wrist`]);
  const knuckles = mix(find(LANDMARK[`${side}Index`]), find(LANDMARK[`${side}Pinky`]), 0.5);
  const wristVisibility = seen(LANDMARK[`${side}Wrist`]);
  return {
    shoulder: find(LANDMARK[`${side}Shoulder`]),
    elbow: find(LANDMARK[`${side}Elbow`]),
    wrist,
    hand: mix(wrist, knuckles, PALM_SHARE),
    shoulderVisibility: seen(LANDMARK[`${side}Shoulder`]),
    wristVisibility,
    armVisibility: Math.min(wristVisibility, seen(LANDMARK[`${side}Elbow`])),
  };
}

function mix(a: ViewPoint, b: ViewPoint, share: number): ViewPoint {
  return {
    x: a.x + (b.x - a.x) * share,
    y: a.y + (b.y - a.y) * share,
    nearer: a.nearer + (b.nearer - a.nearer) * share,
  };
}
