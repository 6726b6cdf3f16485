/**
 * Props: where they are in a hand and on the floor, and their main lengths. Metres and radians.
 *
 * The frame of a prop has its origin at the grip, y along the shaft from the grip to the far end, and z to the front.
 */

import { multiply, rotate } from "./rotation";
import { addScaled, fromCoordinateAxis } from "./vector";

/** Built-in kinds, in the order in which they are offered. Other kinds are ids of stored props. */
export const PROP_KINDS = ["fan", "umbrella", "ball", "branch"] as const;
export type PropKind = (typeof PROP_KINDS)[number];

/** Kinds of props that the server stores: their ids. */
const STORED_KIND = /^[a-z2-7]{20}$/;

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

/** How a prop is in a hand and on the floor. */
export interface PropForm {
  readonly rest: PropRest;
  /**
   * Distance of a held prop from the grip towards the side of the palm. 0: it has a shaft, which goes through the hand;
   * above 0: it lies in the palm, as a ball does.
   */
  readonly palmOffset: number;
}

/** Forms of the kinds. */
export const PROP_FORMS: Readonly<Record<PropKind, PropForm>> = {
  fan: { rest: { pitch: Math.PI / 2, height: 0.012 }, palmOffset: 0 },
  umbrella: { rest: umbrellaRest(), palmOffset: 0 },
  ball: { rest: { pitch: 0, height: BALL_RADIUS_M }, palmOffset: BALL_RADIUS_M + 0.015 },
  branch: { rest: { pitch: Math.PI / 2, height: 0.03 }, palmOffset: 0 },
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

/** Return true if this is one of the built-in kinds. */
export function isPropKind(kind: string): kind is PropKind {
  return (PROP_KINDS as readonly string[]).includes(kind);
}

/** Return true if this kind is the id of a prop that the server stores. */
export function isStoredKind(kind: string): boolean {
  return STORED_KIND.test(kind);
}

/**
 * Write the transform of a prop in a hand (0 left, 1 right) into `out` and return it. `grip` is the frame of the hand's
 * joint at the grip.
 */
export function heldTransform(
  { palmOffset }: PropForm,
  hand: number,
  grip: PropTransform,
  out: PropTransform,
): PropTransform {
  const { position, rotation } = out;
  multiply(rotation, 0, grip.rotation, 0, gripRotation, 0);
  // The prop's z is the hand's x, which points to the left; at rest the palms face each other.
  vector.set([0, 0, (hand === 0 ? -1 : 1) * palmOffset]);
  rotate(vector, 0, rotation, 0, vector, 0);
  addScaled(position, 0, grip.position, 0, vector, 0, 1);
  return out;
}

/** Write the transform of a prop that lies at a place [x, z, turn] of a floor at `floorHeight` into `out`; return it. */
export function laidTransform(
  { rest: { pitch, height } }: PropForm,
  [x, z, turn]: readonly number[],
  floorHeight: number,
  out: PropTransform,
): PropTransform {
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
