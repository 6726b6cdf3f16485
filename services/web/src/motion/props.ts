/**
 * Props: where they are in a hand and on the floor, and their main lengths. Metres and radians.
 *
 * The frame of a prop has its origin at the grip, y along the shaft from the grip to the far end, and z to the front.
 */

import { multiply, rotate } from "./rotation";
import { addScaled, fromCoordinateAxis } from "./vector";

/** Kinds that can be drawn, in the order in which they are offered. */
export const PROP_KINDS = ["fan", "umbrella", "ball", "branch"] as const;
export type PropKind = (typeof PROP_KINDS)[number];

/** Position of the grip between the joint of the wrist and the tip of the hand, as a share of their distance. */
export const GRIP_SHARE = 0.5;
/** Rotation of a held prop in the frame of the hand (w x y z): x to the hand's y, y to its z, z to its x. */
export const GRIP_ROTATION: readonly number[] = [0.5, 0.5, 0.5, 0.5];

/** Height of the umbrella's rim above the grip, its radius, the length of the handle below the grip and its radius. */
export const UMBRELLA = { rimHeight: 0.62, rimRadius: 0.46, handleLength: 0.14, handleRadius: 0.012 } as const;
/** Radius of the ball. */
export const BALL_RADIUS_M = 0.11;

/** How a prop lies: the pitch of its shaft about x, 0 if it is upright, and the height of the grip above the floor. */
export interface PropRest {
  readonly pitch: number;
  readonly height: number;
}

export const PROP_RESTS: Readonly<Record<PropKind, PropRest>> = {
  fan: { pitch: Math.PI / 2, height: 0.012 },
  umbrella: umbrellaRest(),
  ball: { pitch: 0, height: BALL_RADIUS_M },
  branch: { pitch: Math.PI / 2, height: 0.03 },
};

/**
 * Distance of a held prop from the grip towards the side of the palm. Props with a shaft go through the hand; a ball
 * lies in it.
 */
export const PALM_OFFSETS_M: Readonly<Record<PropKind, number>> = {
  fan: 0,
  umbrella: 0,
  ball: BALL_RADIUS_M + 0.015,
  branch: 0,
};

/** Position in metres, and rotation w x y z, in the frame of the stage. */
export interface PropTransform {
  readonly position: Float64Array;
  readonly rotation: Float64Array;
}

/** Create storage for a transform. */
export function createPropTransform(): PropTransform {
  return { position: new Float64Array(3), rotation: Float64Array.of(1, 0, 0, 0) };
}

/** Return true if props of this kind can be drawn. */
export function isPropKind(kind: string): kind is PropKind {
  return (PROP_KINDS as readonly string[]).includes(kind);
}

/**
 * Write the transform of a prop in a hand (0 left, 1 right) into `out` and return it. `grip` is the frame of the hand's
 * joint at the grip.
 */
export function heldTransform(kind: PropKind, hand: number, grip: PropTransform, out: PropTransform): PropTransform {
  const { position, rotation } = out;
  multiply(rotation, 0, grip.rotation, 0, gripRotation, 0);
  // The prop's z is the hand's x, which points to the left; at rest the palms face each other.
  vector.set([0, 0, (hand === 0 ? -1 : 1) * PALM_OFFSETS_M[kind]]);
  rotate(vector, 0, rotation, 0, vector, 0);
  addScaled(position, 0, grip.position, 0, vector, 0, 1);
  return out;
}

/** Write the transform of a prop that lies at a place [x, z, turn] of a floor at `floorHeight` into `out`; return it. */
export function laidTransform(
  kind: PropKind,
  [x, z, turn]: readonly number[],
  floorHeight: number,
  out: PropTransform,
): PropTransform {
  const { pitch, height } = PROP_RESTS[kind];
  fromCoordinateAxis(pitchRotation, 0, 0, pitch);
  fromCoordinateAxis(out.rotation, 0, 1, turn);
  multiply(out.rotation, 0, out.rotation, 0, pitchRotation, 0);
  out.position.set([x, floorHeight + height, z]);
  return out;
}

/** Return the rest in which the rim and the end of the handle touch the floor. */
function umbrellaRest(): PropRest {
  const { rimHeight, rimRadius, handleLength, handleRadius } = UMBRELLA;
  const pitch = Math.atan2(rimHeight + handleLength, rimRadius - handleRadius);
  return { pitch, height: handleLength * Math.cos(pitch) + handleRadius * Math.sin(pitch) };
}

const vector = new Float64Array(3);
const pitchRotation = new Float64Array(4);
const gripRotation = Float64Array.from(GRIP_ROTATION);
