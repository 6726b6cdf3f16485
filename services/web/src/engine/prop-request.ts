/** Request of the page to put a prop into a hand or to lay it down. Loaded with the first one. */
import { Matrix4, Vector3 } from "three";
import { GRIP_SHARE } from "../motion/props";
import type { Performer } from "../stage/puppet/performer";
import { limbNumber, limbWithinPerformer, performerOfLimb } from "../wire/limbs";
import type { PropPresence } from "../wire/messages";
import type { Playback } from "./playback";

/** Reason for which a prop stays where it is: that of the session, or none came, or there was no prop to move. */
export type PropRefusalReason = "held" | "full" | "unknown" | "leg" | "no answer" | "none near";

/** Time after which an unanswered request counts as refused. */
const ANSWER_TIMEOUT_MS = 5_000;
/** Distance in front of a performer at which a prop is laid down, in metres. */
const LAYING_DISTANCE_M = 0.5;
/** Distance over the floor, or from hand to hand, within which a held hand takes a prop, in metres. */
const REACH_M = 0.4;

type PropPlace = [x: number, z: number, turn: number];

/**
 * Put a prop into the hand of number `limb`, or with null lay it down in front of the performer who has it. Return null
 * once the session shows it there, or else the reason.
 */
export function putProp(
  { puppeteer, viewer }: Playback,
  performers: readonly Pick<Performer, "root">[],
  prop: number,
  limb: number | null,
): Promise<PropRefusalReason | null> {
  const find = () => viewer.presence?.props?.find((one) => one.prop === prop);
  const isThere = () => find()?.limb === limb;
  if (isThere()) return Promise.resolve(null);
  const owner = find()?.limb ?? null;
  const performer = owner === null ? undefined : performers[performerOfLimb(owner)];
  return new Promise((resolve) => {
    const ended = new AbortController();
    const { signal } = ended;
    const finish = (refusal: PropRefusalReason | null) => {
      clearTimeout(timer);
      ended.abort();
      resolve(refusal);
    };
    const timer = setTimeout(() => finish("no answer"), ANSWER_TIMEOUT_MS);
    viewer.addEventListener("presence", () => isThere() && finish(null), { signal });
    puppeteer.addEventListener("closed", () => finish("no answer"), { signal });
    puppeteer.addEventListener(
      "prop refusal",
      (event) => {
        const { detail } = event as CustomEvent<{ prop: number; reason: PropRefusalReason }>;
        if (detail.prop === prop) finish(detail.reason);
      },
      { signal },
    );
    const place = limb === null && performer ? placeBefore(performer) : null;
    if (!puppeteer.put(prop, limb, place)) finish("no answer");
  });
}

/**
 * Lay down the prop that is in a hand for which `isHeld` is true, or put the nearest one into such a hand. Return the
 * hand, null if there is none, and the reason if the prop stays where it is.
 */
export async function moveNearestProp(
  playback: Playback | null,
  performers: readonly Pick<Performer, "root" | "hand">[],
  isHeld: (limb: number) => boolean,
): Promise<{ limb: number | null; refusal: PropRefusalReason | null }> {
  const props = playback?.viewer.presence?.props ?? [];
  const hands = performers.flatMap((_, performer) => [0, 1].map((hand) => limbNumber(performer, hand))).filter(isHeld);
  const own = props.find(({ limb }) => limb !== null && hands.includes(limb));
  if (playback && own) return { limb: own.limb, refusal: await putProp(playback, performers, own.prop, null) };
  const gripOf = (limb: number) => {
    const grip = performers[performerOfLimb(limb)]?.hand(limbWithinPerformer(limb), GRIP_SHARE, new Matrix4());
    return grip && new Vector3().setFromMatrixPosition(grip);
  };
  const distance = ({ limb, place: [x, z] }: PropPresence, hand: number) => {
    const at = gripOf(hand) as Vector3;
    return (limb === null ? new Vector3(x, at.y, z) : gripOf(limb))?.distanceTo(at) ?? Infinity;
  };
  const [nearest] = props
    .flatMap((prop) => hands.map((hand) => ({ prop: prop.prop, hand, distance: distance(prop, hand) })))
    .sort((a, b) => a.distance - b.distance);
  if (!playback || !nearest || nearest.distance > REACH_M) return { limb: null, refusal: "none near" };
  return { limb: nearest.hand, refusal: await putProp(playback, performers, nearest.prop, nearest.hand) };
}

/** Return the place in front of a performer, turned like it. */
export function placeBefore({ root }: Pick<Performer, "root">): PropPlace {
  const { x, z } = new Vector3().setFromMatrixPosition(root);
  const front = new Vector3().setFromMatrixColumn(root, 2);
  const turn = Math.atan2(front.x, front.z);
  return [x + LAYING_DISTANCE_M * Math.sin(turn), z + LAYING_DISTANCE_M * Math.cos(turn), turn];
}
