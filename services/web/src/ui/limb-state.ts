/** What the page shows of a session, in the words of the contract. */
import type { Viewer } from "../client/viewer";
import { type PlainMessageKey, pageTranslator } from "../i18n/translator";
import { LIMBS } from "../motion/skeleton";
import { limbNumber, limbWithinPerformer, performerOfLimb } from "../wire/limbs";

export type Presence = NonNullable<Viewer["presence"]>;
export type Timeline = NonNullable<Viewer["timeline"]>;
export type ViewerStatistics = ReturnType<Viewer["statistics"]>;

/** Limbs as people read them, to be said: the puppet's right first, in the order of keys 1 to 4. */
export const LIMB_ORDER: readonly number[] = [1, 0, 3, 2];
export const LIMB_NAMES = [
  "Left hand",
  "Right hand",
  "Left leg",
  "Right leg",
] as const satisfies readonly PlainMessageKey[];

/** The key (1 to 4) that takes a limb. */
export function limbKey(limb: number): number {
  return LIMB_ORDER.indexOf(limbWithinPerformer(limb)) + 1;
}

/** How many performers these are the limbs of. */
export function performerCount(limbs: readonly unknown[]): number {
  return limbs.length / LIMBS.length;
}

/** Limbs as people read them, one performer's after another's. */
export function limbsInKeyOrder(performers: number): number[] {
  return Array.from({ length: performers }, (_, k) => LIMB_ORDER.map((part) => limbNumber(k, part))).flat();
}

/** A limb within a sentence, of one of so many performers: "left hand", or where there are several "left hand of dancer 2". */
export function limbName(limb: number, performers = 1, { translate } = pageTranslator): string {
  const name = translate(LIMB_NAMES[limbWithinPerformer(limb)]).toLowerCase();
  return performers > 1
    ? translate("{limb} of dancer {number}", { limb: name, number: performerOfLimb(limb) + 1 })
    : name;
}

/** Who holds a limb, as the page tells it. */
export interface LimbHolder {
  id: string;
  /** "You" for oneself. */
  name: string;
  colour: number;
  mine: boolean;
}

/** One who asks for a limb that another holds. */
export interface LimbRequester {
  id: string;
  name: string;
  colour: number;
}

/** What the page shows of a limb. */
export interface LimbState {
  holder: LimbHolder | null;
  /** Others who ask for it, first come first. */
  requesters: readonly LimbRequester[];
  /** Whether it is asked for from here. */
  requestedByMe: boolean;
  /** Whether keys and buttons of "the held string" move it. */
  selected: boolean;
}

/** Those who ask for each of the limbs of so many performers, without oneself. */
export function limbRequesters(
  presence: Presence | null,
  self: string | null,
  performers = 1,
  { translate } = pageTranslator,
): LimbRequester[][] {
  return Array.from({ length: limbNumber(performers, 0) }, (_, limb) =>
    (presence?.asks[limb] ?? [])
      .filter((id) => id !== self)
      .map((id) => {
        const person = presence?.puppeteers.find((one) => one.id === id);
        return { id, name: person?.name || translate("Someone"), colour: person?.colour ?? 0 };
      }),
  );
}

/** Holders of the limbs of so many performers, null where free. The session may tell of fewer or more while the dance is changed. */
export function limbHolders(
  presence: Presence | null,
  self: string | null,
  performers = 1,
  { translate } = pageTranslator,
): (LimbHolder | null)[] {
  return Array.from({ length: limbNumber(performers, 0) }, (_, limb) => {
    const id = presence?.limbs[limb];
    if (!id) return null;
    const person = presence?.puppeteers.find((one) => one.id === id);
    const mine = id === self;
    return {
      id,
      mine,
      name: mine ? translate("You") : person?.name || translate("Someone"),
      colour: person?.colour ?? 0,
    };
  });
}
