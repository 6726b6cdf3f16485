/** Two-bone inverse kinematics of a drawn leg: hip and knee turn so that the ankle comes to a place. */
import { Matrix4, type Object3D, Quaternion, Vector3 } from "three";

/** Nodes of a leg. */
export interface Leg {
  readonly hip: Object3D;
  readonly knee: Object3D;
  readonly ankle: Object3D;
  /** Axis about which the knee bends, in the frame of the hip's node: to the figure's left at rest. */
  readonly hinge: Vector3;
}

/** Share of its length to which a leg is stretched; a pose may stretch it further. */
export const MAX_STRETCH = 0.995;
/** Correction with which a knee that is bent backwards is bent to the front, as a share of the leg. */
const FLIP_SHARE = 0.0025;

/**
 * Turn hip and knee so that the ankle is at the `target` in the world frame, or as near as the leg reaches. The foot
 * keeps its direction, and the knee its distance from the plane in which it bends to the front. `moved` is how far the
 * target is from where the leg has it, metres. World matrices are up to date before and after.
 */
export function turnLeg({ hip, knee, ankle, hinge }: Leg, target: Vector3, moved: number): void {
  worldRotation(ankle, footRotation);
  start.setFromMatrixPosition(hip.matrixWorld);
  thigh.setFromMatrixPosition(knee.matrixWorld).sub(start);
  along.setFromMatrixPosition(ankle.matrixWorld).sub(start);
  shank.copy(along).sub(thigh);
  goal.copy(target).sub(start);
  const [thighLength, shankLength] = [thigh.length(), shank.length()];
  const reach = Math.max(MAX_STRETCH * (thighLength + shankLength), along.length());
  const distance = Math.min(Math.max(goal.length(), Math.abs(thighLength - shankLength) + 1e-6), reach);
  // Axes of the leg: along it, to the left and to the front.
  along.normalize();
  left.copy(hinge).transformDirection(hip.matrixWorld).projectOnPlane(along).normalize();
  front.crossVectors(along, left);
  const forwards = thigh.dot(front);
  swing.setFromUnitVectors(along, goal.normalize());
  const middle = (thighLength ** 2 + distance ** 2 - shankLength ** 2) / (2 * distance);
  const bulge = Math.sqrt(Math.max(thighLength ** 2 - middle ** 2, 0));
  const sideways = Math.min(Math.max(thigh.dot(left), -bulge), bulge);
  let ahead = Math.sqrt(bulge ** 2 - sideways ** 2);
  if (forwards < 0)
    ahead = forwards + (ahead - forwards) * Math.min(moved / (FLIP_SHARE * (thighLength + shankLength)), 1);
  const share = Math.sqrt(Math.max(thighLength ** 2 - ahead ** 2 - sideways ** 2, 0));
  bent.copy(goal).multiplyScalar(share);
  bent.addScaledVector(front.applyQuaternion(swing), ahead).addScaledVector(left.applyQuaternion(swing), sideways);
  thigh.applyQuaternion(swing).normalize();
  shank.applyQuaternion(swing);
  turn.setFromUnitVectors(thigh, scratch.copy(bent).normalize());
  shank.applyQuaternion(turn).normalize();
  turnInWorld(hip, turn.multiply(swing));
  hip.updateWorldMatrix(false, true);
  turn.setFromUnitVectors(shank, goal.multiplyScalar(distance).sub(bent).normalize());
  turnInWorld(knee, turn);
  knee.updateWorldMatrix(false, false);
  ankle.quaternion.copy(
    worldRotation(ankle.parent as Object3D, parentRotation)
      .invert()
      .multiply(footRotation),
  );
  knee.updateWorldMatrix(false, true);
}

/** Apply a rotation of the world frame to a node; its world matrix is not updated. */
function turnInWorld(node: Object3D, rotation: Quaternion): void {
  const parent = worldRotation(node.parent as Object3D, parentRotation);
  node.quaternion.premultiply(parent).premultiply(rotation).premultiply(parent.invert());
}

/** Write the rotation of a node in the world frame, without its scale, into `out`. */
export function worldRotation(node: Object3D, out: Quaternion): Quaternion {
  return out.setFromRotationMatrix(matrix.extractRotation(node.matrixWorld));
}

const matrix = new Matrix4();
const scratch = new Vector3();
const start = new Vector3();
const goal = new Vector3();
const thigh = new Vector3();
const shank = new Vector3();
const bent = new Vector3();
const along = new Vector3();
const left = new Vector3();
const front = new Vector3();
const swing = new Quaternion();
const turn = new Quaternion();
const footRotation = new Quaternion();
const parentRotation = new Quaternion();
