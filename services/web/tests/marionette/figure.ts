/** Figure of the golden vectors and the bend table of its arms. */

import { parseBendTable } from "../../src/marionette/arm";
import { armProportions } from "../../src/marionette/limb-rig";
import { decodeBase64 } from "../golden-vectors";
import { golden } from "./golden";

export const figure = {
  offsets: Float64Array.from(golden.limbs.offsets.flat()),
  tips: Float64Array.from(golden.limbs.tips.flat()),
};
export const { identity } = armProportions(figure, 0);
export const packed = decodeBase64(golden.arms.find((arm) => arm.proportions === identity)!.table);
export const table = parseBendTable(packed);

/** Return the angle between two rotations (4 each), radians. */
export function rotationAngle(a: Float64Array, aAt: number, b: Float64Array, bAt: number): number {
  let dot = 0,
    square = 0;
  for (let i = 0; i < 4; i++) dot += a[aAt + i] * b[bAt + i];
  const sign = Math.sign(dot);
  for (let i = 0; i < 4; i++) square += (a[aAt + i] * sign - b[bAt + i]) ** 2;
  return 4 * Math.asin(Math.min(Math.sqrt(square) / 2, 1));
}
