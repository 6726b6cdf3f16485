import { expect, test } from "vitest";
import { holderColour, isPulledHere, limbButtonName, openCrowd } from "../../src/ui/limb-display";
import type { LimbCrowd, LimbState } from "../../src/ui/limb-state";

test("an open limb is pulled with the audience unless a puppeteer holds it", () => {
  const audience = { id: "crowd", name: "The audience", colour: 0, mine: false };
  const [aiko, you] = [
    { id: "a", name: "Aiko", colour: 2, mine: false },
    { id: "b", name: "You", colour: 1, mine: true },
  ];
  const crowd: LimbCrowd = { policy: "median", pulls: 3, votes: null, hasTurn: false, isPulled: false };
  const stateOf = (changes: Partial<LimbState>): LimbState => ({
    holder: null,
    requesters: [],
    requestedByMe: false,
    selected: false,
    ...changes,
  });
  const nameOf = (changes: Partial<LimbState>) => limbButtonName(stateOf(changes), "left hand");
  expect([nameOf({}), nameOf({ holder: you }), nameOf({ holder: aiko })]).toEqual([
    "Take the left hand",
    "Release the left hand, held by you",
    "Left hand, held by Aiko",
  ]);
  expect(nameOf({ holder: aiko, requestedByMe: true })).toBe("Left hand, held by Aiko, asked for");
  expect([nameOf({ crowd }), nameOf({ crowd, holder: audience }), nameOf({ crowd, holder: aiko })]).toEqual([
    "Pull the left hand with the audience",
    "Pull the left hand with the audience",
    "Left hand, held by Aiko",
  ]);
  const pulled = { crowd: { ...crowd, isPulled: true }, holder: audience };
  expect(nameOf(pulled)).toBe("Let go of the left hand");
  expect([pulled, { holder: you }, { crowd }, {}].map((changes) => isPulledHere(stateOf(changes)))).toEqual([
    true,
    true,
    false,
    false,
  ]);
  expect([openCrowd(stateOf({ crowd, holder: aiko })), openCrowd(stateOf({ crowd }))]).toEqual([null, crowd]);
  expect([holderColour(audience), holderColour(aiko)]).toEqual(["var(--text)", "var(--holder-2)"]);
});
