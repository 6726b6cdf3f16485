/** From places and directions in the world to what the contract's inputs carry (SPEC, Input). Pure. */
import { type Matrix4, Quaternion, Vector3 } from "three";

/** A hand's tip in the shoulder's frame: axes of the chest (vl5), origin at the shoulder, in arm lengths. */
export function toShoulderFrame(tip: Vector3, shoulder: Vector3, chest: Quaternion, armLength: number): Vector3 {
  return tip.clone().sub(shoulder).applyQuaternion(chest.clone().invert()).divideScalar(armLength);
}

/** A direction of the world in the axes of the chest. */
export function toChestFrame(direction: Vector3, chest: Quaternion): Vector3 {
  return direction.clone().applyQuaternion(chest.clone().invert());
}

/**
 * The thigh's angle forwards from straight down, radians, that brings the knee to the height of `knee` as the pelvis sees
 * it. From the audience forwards and backwards look alike, so height alone decides: up to the hip and over it is forwards,
 * pulled below where the leg is straight it goes back by the same measure.
 */
export function solveThighAngle(knee: Vector3, hip: Vector3, pelvis: Quaternion, thighLength: number): number {
  const down = -toChestFrame(knee.clone().sub(hip), pelvis).y / thighLength;
  return down <= 1 ? Math.acos(Math.max(-1, down)) : -Math.acos(Math.max(-1, 2 - down));
}

/** Orientation and place of a world matrix. */
export function orientationOf(matrix: Matrix4): Quaternion {
  return new Quaternion().setFromRotationMatrix(matrix);
}

export function positionOf(matrix: Matrix4): Vector3 {
  return new Vector3().setFromMatrixPosition(matrix);
}
