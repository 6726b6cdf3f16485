/**
 * Landmarks of a body as BlazePose finds them: 33 points, each x, y, z and visibility (0 to 1). Left and right are
 * those of the person. Pure.
 */

export const LANDMARK_COUNT = 33;
/** Numbers of a landmark: x, y, z, visibility. */
export const LANDMARK_STRIDE = 4;

/** Landmarks by name, as far as they are used. */
export const LANDMARK = {
  nose: 0,
  leftEar: 7,
  rightEar: 8,
  leftShoulder: 11,
  rightShoulder: 12,
  leftElbow: 13,
  rightElbow: 14,
  leftWrist: 15,
  rightWrist: 16,
  leftPinky: 17,
  rightPinky: 18,
  leftIndex: 19,
  rightIndex: 20,
  leftThumb: 21,
  rightThumb: 22,
  leftHip: 23,
  rightHip: 24,
  leftKnee: 25,
  rightKnee: 26,
  leftAnkle: 27,
  rightAnkle: 28,
  leftHeel: 29,
  rightHeel: 30,
  leftToes: 31,
  rightToes: 32,
} as const;

export type LandmarkName = keyof typeof LANDMARK;

/** Landmarks of one picture. */
export interface DetectedBody {
  /**
   * In the picture (132): x to its right and y downwards, 0 to 1; z in the unit of x, negative towards the camera.
   */
  readonly image: Float64Array;
  /**
   * In space (132), in metres as far as the model knows the person's size; origin between the hips, x to the picture's
   * right, y downwards, z away from the camera.
   */
  readonly world: Float64Array;
}

/** Return the visibility of a landmark. */
export function visibilityOf(landmarks: ArrayLike<number>, landmark: number): number {
  return landmarks[landmark * LANDMARK_STRIDE + 3];
}
