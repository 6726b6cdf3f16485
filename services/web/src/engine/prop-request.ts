/** Request of the page to put a prop into a hand or to lay it down. Loaded with the first one. */
import { Vector3 } from "three";
import type { Performer } from "../stage/puppet/performer";
import { performerOfLimb } from "../wire/limbs";
import type { Playback } from "./playback";

/** Reason for which a prop stays where it is: that of the session, or none came. */
export type PropRefusalReason = "held" | "full" | "unknown" | "leg" | "no answer";

/** Time after which an unanswered request counts as refused. */
const ANSWER_TIMEOUT_MS = 5_000;
/** Distance in front of a performer at which a prop is laid down, in metres. */
const LAYING_DISTANCE_M = 0.5;

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

/** Return the place in front of a performer, turned like it. */
export function placeBefore({ root }: Pick<Performer, "root">): PropPlace {
  const { x, z } = new Vector3().setFromMatrixPosition(root);
  const front = new Vector3().setFromMatrixColumn(root, 2);
  const turn = Math.atan2(front.x, front.z);
  return [x + LAYING_DISTANCE_M * Math.sin(turn), z + LAYING_DISTANCE_M * Math.cos(turn), turn];
}
