/** Contacts of a performer's feet with the floor. */

import { LIMBS } from "./skeleton";

/** Part of a performer that tracks of contacts describe. */
export const CONTACT_PART = "contacts";
/** Prefixes of the joints of each foot, in the order of contacts. */
export const FEET: readonly string[] = ["l", "r"];

/** Feet that are planted at one instant. Bit 0 is the left foot, bit 1 the right one. */
export interface FootContacts {
  planted: number;
  /** Feet of legs that are controlled; they are not planted. */
  controlled: number;
  /** Presented clock time of the instant, microseconds. */
  clock: number;
}

/** Mark the feet of controlled legs; bit 0 of `controlledLimbs` is the performer's first limb. */
export function markControlledLegs(contacts: FootContacts, controlledLimbs: number): void {
  contacts.controlled = (controlledLimbs >> LIMBS.indexOf("left_leg")) & 3;
  contacts.planted &= ~contacts.controlled;
}
