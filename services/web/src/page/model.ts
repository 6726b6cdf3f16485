/** What the page shows of a session, in the words of the contract. */
import type { Viewer } from "../client/viewer";
import { LIMBS } from "../motion/skeleton";
import { limbNumber, limbOf, performerOf } from "../wire/limbs";
import { pageSpeech, type Plain } from "../words/say";

export type Presence = NonNullable<Viewer["presence"]>;
export type Timeline = NonNullable<Viewer["timeline"]>;
export type LineFigures = ReturnType<Viewer["line"]>;

/** Limbs as people read them, to be said: the puppet's right first, in the order of keys 1 to 4. */
export const LIMB_ORDER: readonly number[] = [1, 0, 3, 2];
export const LIMB_NAMES = ["Left hand", "Right hand", "Left leg", "Right leg"] as const satisfies readonly Plain[];

/** The key (1 to 4) that takes a limb. */
export function limbKey(limb: number): number {
  return LIMB_ORDER.indexOf(limbOf(limb)) + 1;
}

/** How many performers these are the limbs of. */
export function performersOf(limbs: readonly unknown[]): number {
  return limbs.length / LIMBS.length;
}

/** Limbs as people read them, one performer's after another's. */
export function limbsInOrder(performers: number): number[] {
  return Array.from({ length: performers }, (_, k) => LIMB_ORDER.map((part) => limbNumber(k, part))).flat();
}

/** A limb within a sentence, of one of so many performers: "left hand", or where there are several "left hand of dancer 2". */
export function limbName(limb: number, performers = 1, { say } = pageSpeech): string {
  const name = say(LIMB_NAMES[limbOf(limb)]).toLowerCase();
  return performers > 1 ? say("{limb} of dancer {number}", { limb: name, number: performerOf(limb) + 1 }) : name;
}

/** Who holds a limb, as the page tells it. */
export interface Holder {
  id: string;
  /** "You" for oneself. */
  name: string;
  colour: number;
  mine: boolean;
}

/** One who asks for a limb that another holds. */
export interface Asker {
  id: string;
  name: string;
  colour: number;
}

/** What the page shows of a limb. */
export interface LimbState {
  holder: Holder | null;
  /** Others who ask for it, first come first. */
  askers: readonly Asker[];
  /** Whether it is asked for from here. */
  asked: boolean;
  /** Whether keys and buttons of "the held string" move it. */
  selected: boolean;
}

/** Those who ask for each of the limbs of so many performers, without oneself. */
export function askers(presence: Presence | null, self: string | null, performers = 1, { say } = pageSpeech): Asker[][] {
  return Array.from({ length: limbNumber(performers, 0) }, (_, limb) =>
    (presence?.asks[limb] ?? []).filter((id) => id !== self).map((id) => {
      const person = presence?.puppeteers.find((one) => one.id === id);
      return { id, name: person?.name || say("Someone"), colour: person?.colour ?? 0 };
    }),
  );
}

/** Holders of the limbs of so many performers, null where free. The session may tell of fewer or more while the dance is changed. */
export function holders(presence: Presence | null, self: string | null, performers = 1, { say } = pageSpeech): (Holder | null)[] {
  return Array.from({ length: limbNumber(performers, 0) }, (_, limb) => {
    const id = presence?.limbs[limb];
    if (!id) return null;
    const person = presence?.puppeteers.find((one) => one.id === id);
    const mine = id === self;
    return { id, mine, name: mine ? say("You") : person?.name || say("Someone"), colour: person?.colour ?? 0 };
  });
}
