/**
 * Position of a hand relative to its shoulder, in arm lengths, from a picture. Across the picture it is measured, with
 * the perspective of a typical camera; the depth is the model's estimate. Pure.
 */
import type { HandReach } from "../input/body-input";
import { type ArmView, FOCAL_LENGTH, type Side } from "./body-view";

/** Share of the model's depth that is believed: it overestimates depth as often as it sees none. */
const DEPTH_SHARE = 0.85;
/** Smallest distance of a hand from the camera, in arm lengths. */
const MIN_DISTANCE = 0.2;
/** Farthest hand, middle of the palm, in arm lengths from shoulder to wrist. */
const MAX_STRETCH = 1.13;

/**
 * Return the reach of a hand. `scale` is in heights of the picture per metre of the model (`BodyView`), `armLength` in
 * metres of the model (`Calibration`).
 */
export function handReach({ shoulder, hand }: ArmView, side: Side, scale: number, armLength: number): HandReach {
  const distance = FOCAL_LENGTH / (scale * armLength);
  const forwards = Math.min((hand.nearer / armLength) * DEPTH_SHARE, distance - MIN_DISTANCE);
  const across = (axis: "x" | "y") => (hand[axis] * (distance - forwards) - shoulder[axis] * distance) / FOCAL_LENGTH;
  // The person faces the camera: the left side is at the right of the picture.
  const outwards = side === "left" ? across("x") : -across("x");
  const up = across("y");
  const length = Math.hypot(outwards, up, forwards);
  const share = length > MAX_STRETCH ? MAX_STRETCH / length : 1;
  return [outwards * share, up * share, forwards * share];
}
