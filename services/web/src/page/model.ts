/** What the page shows of a session, in the words of the contract. */
import type { Viewer } from "../client/viewer";
import { say, type Plain } from "../words/say";

export type Presence = NonNullable<Viewer["presence"]>;
export type Timeline = NonNullable<Viewer["timeline"]>;
export type LineFigures = ReturnType<Viewer["line"]>;

/** Limbs as people read them, to be said: the puppet's right first, in the order of keys 1 to 4. */
export const LIMB_ORDER: readonly number[] = [1, 0, 3, 2];
export const LIMB_NAMES = ["Left hand", "Right hand", "Left leg", "Right leg"] as const satisfies readonly Plain[];

/** The key (1 to 4) that takes a limb. */
export function limbKey(limb: number): number {
  return LIMB_ORDER.indexOf(limb) + 1;
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

/** Those who ask for each of the four limbs, without oneself. */
export function askers(presence: Presence | null, self: string | null): Asker[][] {
  return [0, 1, 2, 3].map((limb) =>
    (presence?.asks[limb] ?? []).filter((id) => id !== self).map((id) => {
      const person = presence?.puppeteers.find((one) => one.id === id);
      return { id, name: person?.name || say("Someone"), colour: person?.colour ?? 0 };
    }),
  );
}

/** Holders of the four limbs, null where free. */
export function holders(presence: Presence | null, self: string | null): (Holder | null)[] {
  return [0, 1, 2, 3].map((limb) => {
    const id = presence?.limbs[limb];
    if (!id) return null;
    const person = presence?.puppeteers.find((one) => one.id === id);
    const mine = id === self;
    return { id, mine, name: mine ? say("You") : person?.name || say("Someone"), colour: person?.colour ?? 0 };
  });
}
