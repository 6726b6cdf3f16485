import { describe, expect, test } from "vitest";
import { JAPANESE_PAGE_MESSAGES } from "../../../src/i18n/japanese";
import {
  describePolicy,
  describePulls,
  POLICY_EFFECTS,
  POLICY_NAMES,
  secondsOfTurn,
} from "../../../src/ui/crowd/crowd-text";
import type { LimbCrowd } from "../../../src/ui/limb-state";

const [LEFT_HAND, LEFT_LEG] = [0, 2];

function crowdOf(changes: Partial<LimbCrowd> = {}): LimbCrowd {
  return { policy: "median", pulls: 0, votes: null, hasTurn: false, isPulled: false, ...changes };
}

test("seconds of a turn count from 5 to 1 within each multiple of 5 s", () => {
  const at = (seconds: number) => secondsOfTurn(1_790_000_000e6 + seconds * 1e6);
  expect([at(0), at(0.001), at(1.5), at(4), at(4.999), at(5)]).toEqual([5, 5, 4, 1, 1, 5]);
});

test("number of people who pull, with and without this page", () => {
  expect([0, 1, 12].map((pulls) => describePulls(crowdOf({ pulls })))).toEqual([
    "Open to the audience",
    "1 person pulls",
    "12 people pull",
  ]);
  // The number in the presence may be older than this page's own pull.
  expect([0, 1, 2, 12].map((pulls) => describePulls(crowdOf({ pulls, isPulled: true })))).toEqual([
    "You pull",
    "You pull",
    "You and 1 other pull",
    "You and 11 others pull",
  ]);
});

describe("policy", () => {
  const turns = { policy: "turns", pulls: 3 };
  test.each([
    ["nobody pulls", { policy: "turns" }, "Drag its ring to pull it"],
    ["own turn", { ...turns, isPulled: true, hasTurn: true }, "Your turn, 4 s left"],
    ["another's turn", { ...turns, isPulled: true }, "Another's turn, 4 s left. Keep pulling for yours"],
    ["others pull in turns", turns, "One at a time, next turn in 4 s"],
    ["median", { pulls: 3 }, ""],
    ["votes are not known", { policy: "vote", pulls: 3 }, "The gesture with the most votes wins"],
    ["votes", { policy: "vote", pulls: 9, votes: [0, 3, 0, 0, 6] }, "Votes: across 6, to the side 3"],
    ["policy of a later release", { policy: "lottery", pulls: 3 }, ""],
  ])("%s", (_, changes, text) => {
    expect(describePolicy(LEFT_HAND, crowdOf(changes), 4)).toBe(text);
  });

  test("legs have gestures of their own", () => {
    const crowd = crowdOf({ policy: "vote", pulls: 4, votes: [1, 0, 0, 3] });
    expect(describePolicy(LEFT_LEG, crowd, 1)).toBe("Votes: to the back 3, up 1");
  });

  test("every name and effect is translated", () => {
    for (const text of [...Object.values(POLICY_NAMES), ...Object.values(POLICY_EFFECTS)])
      expect(JAPANESE_PAGE_MESSAGES).toHaveProperty([text]);
  });
});
