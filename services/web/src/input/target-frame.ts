/** Conversion of world positions and directions to the values of inputs (proto/control.md, 5.1). Pure. */
import { type Matrix4, Quaternion, Vector3 } from "three";

/** Return a hand's tip in the shoulder's frame: axes of the chest (vl5), origin at the shoulder, in arm lengths. */
export function toShoulderFrame(tip: Vector3, shoulder: Vector3, chest: Quaternion, armLength: number): Vector3 {
  return tip.clone().sub(shoulder).applyQuaternion(chest.clone().invert()).divideScalar(armLength);
}

/** Return the world position of a place in the shoulder's frame, the inverse of `toShoulderFrame`. */
export function fromShoulderFrame(place: Vector3, shoulder: Vector3, chest: Quaternion, armLength: number): Vector3 {
  return place.clone().multiplyScalar(armLength).applyQuaternion(chest).add(shoulder);
}

/** Return a world direction in the axes of the chest. */
export function toChestFrame(direction: Vector3, chest: Quaternion): Vector3 {
  return direction.clone().applyQuaternion(chest.clone().invert());
}

/**
 * Return the thigh's forward angle from straight down, in radians, that moves the knee to the height of `knee` in the
 * pelvis's frame. The audience cannot tell forwards from backwards, so height alone decides: up to the hip and above it
 * is forwards; pulled below the straight leg, the thigh goes backwards by the same amount.
 */
export function solveThighAngle(knee: Vector3, hip: Vector3, pelvis: Quaternion, thighLength: number): number {
  const down = -toChestFrame(knee.clone().sub(hip), pelvis).y / thighLength;
  return down <= 1 ? Math.acos(Math.max(-1, down)) : -Math.acos(Math.max(-1, 2 - down));
}

export function orientationOf(matrix: Matrix4): Quaternion {
  return new Quaternion().setFromRotationMatrix(matrix);
}

export function positionOf(matrix: Matrix4): Vector3 {
  return new Vector3().setFromMatrixPosition(matrix);
}
