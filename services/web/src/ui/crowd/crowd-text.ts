/** Texts on the audience of an open limb: how many pull it, whose turn it is, and the votes. Pure. */
import { pageTranslator } from "../../i18n/translator";
import { isHand } from "../../wire/limbs";
import type { LimbCrowd } from "../limb-state";

/** Policies of an audience, and their names (proto/control.md, 5.11). The first is the default. */
export const POLICY_NAMES = {
  "trimmed mean": "Mean without extremes",
  median: "Median",
  turns: "Turns of 5 s",
  vote: "Vote between gestures",
} as const;
export type CrowdPolicy = keyof typeof POLICY_NAMES;

/** Effects of the policies. */
export const POLICY_EFFECTS = {
  "trimmed mean": "Everybody counts. A few who pull elsewhere have little effect.",
  median: "The limb goes to the middle of all pulls.",
  turns: "The limb follows one person at a time, chosen by lot.",
  vote: "The limb shows the gesture that most people pull to.",
} as const satisfies Record<CrowdPolicy, string>;

/** Gestures in the order of the votes. */
const HAND_GESTURES = ["up", "to the side", "to the front", "down", "across"] as const;
const LEG_GESTURES = ["up", "to the front", "down", "to the back"] as const;

/** Duration of a turn in microseconds. Turns begin at multiples of it. */
const TURN_US = 5_000_000;

/** Return the seconds until the next turn, 1 to 5, at a clock time in microseconds. */
export function secondsOfTurn(clockUs: number): number {
  return Math.ceil((TURN_US - (clockUs % TURN_US)) / 1e6);
}

/** Say how many people pull. */
export function describePulls({ pulls, isPulled }: LimbCrowd, { translate } = pageTranslator): string {
  // The server counts once per second.
  const count = Math.max(pulls, isPulled ? 1 : 0);
  if (count === 0) return translate("Open to the audience");
  if (!isPulled) return count === 1 ? translate("1 person pulls") : translate("{count} people pull", { count });
  if (count === 1) return translate("You pull");
  return count === 2
    ? translate("You and 1 other pull")
    : translate("You and {count} others pull", { count: count - 1 });
}

/** Say whose turn it is, how the votes are, or how to take part; empty if there is nothing to say. */
export function describePolicy(
  limb: number,
  crowd: LimbCrowd,
  turnSeconds: number,
  { translate } = pageTranslator,
): string {
  const { policy, pulls, hasTurn, isPulled } = crowd;
  if (pulls === 0 && !isPulled) return translate("Drag its ring to pull it");
  if (policy === "turns") {
    const seconds = { seconds: turnSeconds };
    if (hasTurn) return translate("Your turn, {seconds} s left", seconds);
    return isPulled
      ? translate("Another's turn, {seconds} s left. Keep pulling for yours", seconds)
      : translate("One at a time, next turn in {seconds} s", seconds);
  }
  return policy === "vote" ? describeVotes(limb, crowd.votes ?? [], { translate }) : "";
}

function describeVotes(
  limb: number,
  votes: readonly number[],
  { translate }: Pick<typeof pageTranslator, "translate">,
): string {
  const gestures = isHand(limb) ? HAND_GESTURES : LEG_GESTURES;
  const counted = gestures
    .map((gesture, index) => ({ gesture, count: votes[index] ?? 0 }))
    .filter(({ count }) => count > 0)
    .sort((a, b) => b.count - a.count);
  if (counted.length === 0) return translate("The gesture with the most votes wins");
  const results = counted.map(({ gesture, count }) => `${translate(gesture)} ${count}`);
  return translate("Votes: {votes}", { votes: results.join(translate(", ")) });
}
