/** State of limbs as the page shows it, derived from the session's presence messages. */
import type { Viewer } from "../client/viewer";
import { type PlainMessageKey, pageTranslator } from "../i18n/translator";
import { LIMBS } from "../motion/skeleton";
import { CROWD, limbNumber, limbWithinPerformer, performerOfLimb } from "../wire/limbs";

export type Presence = NonNullable<Viewer["presence"]>;
export type Timeline = NonNullable<Viewer["timeline"]>;
export type ViewerStatistics = ReturnType<Viewer["statistics"]>;

/** Limbs of one performer in the order of keys 1 to 4: the puppet's right side first. */
export const LIMB_ORDER: readonly number[] = [1, 0, 3, 2];
/** Names of limbs, by number; translate them before display. */
export const LIMB_NAMES = [
  "Left hand",
  "Right hand",
  "Left leg",
  "Right leg",
] as const satisfies readonly PlainMessageKey[];

/** Return the key (1 to 4) that claims a limb. */
export function limbKey(limb: number): number {
  return LIMB_ORDER.indexOf(limbWithinPerformer(limb)) + 1;
}

/** Return the number of performers that a list of all their limbs belongs to. */
export function performerCount(limbs: readonly unknown[]): number {
  return limbs.length / LIMBS.length;
}

/** Return the limbs of all performers, one performer after another, each in key order. */
export function limbsInKeyOrder(performers: number): number[] {
  return Array.from({ length: performers }, (_, k) => LIMB_ORDER.map((part) => limbNumber(k, part))).flat();
}

/** Name a limb within a sentence: "left hand", or with several performers "left hand of dancer 2". */
export function limbName(limb: number, performers = 1, { translate } = pageTranslator): string {
  const name = translate(LIMB_NAMES[limbWithinPerformer(limb)]).toLowerCase();
  return performers > 1
    ? translate("{limb} of dancer {number}", { limb: name, number: performerOfLimb(limb) + 1 })
    : name;
}

/** Holder of a limb. */
export interface LimbHolder {
  id: string;
  /** "You" for this page's own user. */
  name: string;
  colour: number;
  mine: boolean;
}

/** User who asks for a limb that another user holds. */
export interface LimbRequester {
  id: string;
  name: string;
  colour: number;
}

/** Pull of the audience on a limb that is open to it. */
export interface LimbCrowd {
  readonly policy: string;
  /** Number of people who pull. */
  readonly pulls: number;
  /** Votes for each gesture; null if they do not decide, or are not known. */
  readonly votes: readonly number[] | null;
  /** True if the limb follows this page's pull, in its turn. */
  readonly hasTurn: boolean;
  /** True if this page pulls it. */
  readonly isPulled: boolean;
}

/** State of one limb. */
export interface LimbState {
  holder: LimbHolder | null;
  /** Other users who ask for it, in the order of their requests. */
  requesters: readonly LimbRequester[];
  /** True if this page asks for it. */
  requestedByMe: boolean;
  /** True if the keys and buttons of "the held string" move it. */
  selected: boolean;
  /** Absent: the limb is not open to the audience. */
  crowd?: LimbCrowd;
}

/** Return the requesters of each limb of `performers` performers, except `self`. */
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
        const person = presence?.puppeteers.find((puppeteer) => puppeteer.id === id);
        return { id, name: person?.name || translate("Someone"), colour: person?.colour ?? 0 };
      }),
  );
}

/**
 * Return the holder of each limb of `performers` performers, null for a free limb. While the motion changes,
 * `presence` may contain fewer or more limbs than that.
 */
export function limbHolders(
  presence: Presence | null,
  self: string | null,
  performers = 1,
  { translate } = pageTranslator,
): (LimbHolder | null)[] {
  return Array.from({ length: limbNumber(performers, 0) }, (_, limb) => {
    const id = presence?.limbs[limb];
    if (!id) return null;
    const person = presence?.puppeteers.find((puppeteer) => puppeteer.id === id);
    const mine = id === self;
    return {
      id,
      mine,
      name: mine ? translate("You") : person?.name || translate(id === CROWD ? "The audience" : "Someone"),
      colour: person?.colour ?? 0,
    };
  });
}
