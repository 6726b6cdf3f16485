/** Ideal detections of a figure before a camera, for tests. */
import type { Pose } from "../../src/motion/skeleton";
import { ARM_M, bodyFigure } from "../../src/webcam/body-figure";
import {
  type DetectedBody,
  LANDMARK,
  LANDMARK_COUNT,
  LANDMARK_STRIDE,
  type LandmarkName,
} from "../../src/webcam/landmark";
import { landmarksOf } from "./arbitrary-body";

/** Focal length in heights of the picture, and width of the picture in heights. */
const FOCAL_LENGTH = 1.2;
export const ASPECT = 4 / 3;

const figure = bodyFigure();
export const SHOULDER_WIDTH_M = 0.4;

export interface DetectionOptions {
  /** Distance of the hips from the camera, in metres. */
  distance?: number;
  /** Offset of the person from the middle of the picture, in metres. */
  right?: number;
  /** Height of the hips above the place that they have when the person stands, in metres. */
  up?: number;
  /** Metres of the model per metre. */
  modelScale?: number;
}

/** Return what an ideal detector finds of the figure in a pose; landmarks outside the picture are not visible. */
export function detect(
  pose: Pose,
  { distance = 2, right = 0, up = 0, modelScale = 1 }: DetectionOptions = {},
): DetectedBody {
  const world = landmarksOf(figure, pose);
  const image = new Float64Array(LANDMARK_COUNT * LANDMARK_STRIDE);
  for (let at = 0; at < world.length; at += LANDMARK_STRIDE) {
    const depth = distance + world[at + 2];
    // The middle of the picture is 0.35 m above the hips.
    const x = 0.5 + ((world[at] + right) * FOCAL_LENGTH) / depth / ASPECT;
    const y = 0.5 + ((world[at + 1] + 0.35 - up) * FOCAL_LENGTH) / depth;
    const visibility = x > 0 && x < 1 && y > 0 && y < 1 ? world[at + 3] : 0.1;
    image.set([x, y, world[at + 2], visibility], at);
    for (let axis = 0; axis < 3; axis++) world[at + axis] *= modelScale;
    world[at + 3] = visibility;
  }
  return { image, world };
}

/** Set the visibility of landmarks, in place. Return the body. */
export function hide(body: DetectedBody, visibility: number, ...names: LandmarkName[]): DetectedBody {
  for (const name of names)
    body.image[LANDMARK[name] * LANDMARK_STRIDE + 3] = body.world[LANDMARK[name] * LANDMARK_STRIDE + 3] = visibility;
  return body;
}

/** Return the middle of the figure's palm relative to its shoulder, in arm lengths: outwards, up and forwards. */
export function trueReach(pose: Pose, side: "left" | "right"): [number, number, number] {
  const world = landmarksOf(figure, pose);
  const find = (name: LandmarkName) => [0, 1, 2].map((axis) => world[LANDMARK[name] * LANDMARK_STRIDE + axis]);
  const [shoulder, wrist, index, pinky] = (["Shoulder", "Wrist", "Index", "Pinky"] as const).map((part) =>
    find(`${side}${part}`),
  );
  const [x, y, z] = wrist.map(
    (value, axis) => (value + 0.8 * ((index[axis] + pinky[axis]) / 2 - value) - shoulder[axis]) / ARM_M,
  );
  return [side === "left" ? x : -x, -y, -z];
}
