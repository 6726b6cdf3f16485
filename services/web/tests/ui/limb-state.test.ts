import { expect, test } from "vitest";
import {
  holderColour,
  isPulledHere,
  type LimbCrowd,
  type LimbState,
  limbButtonName,
  limbHolders,
  limbKey,
  limbName,
  limbRequesters,
  limbsInKeyOrder,
  openCrowd,
  performerCount,
} from "../../src/ui/limb-state";

test("holders and requesters of limbs have names and colours", () => {
  const presence = {
    name: "Presence" as const,
    live: null,
    bonds: null,
    crowd: null,
    viewers: 2,
    puppeteers: [
      { id: "a", name: "Aiko", colour: 0 },
      { id: "b", name: "Mateo", colour: 1 },
    ],
    limbs: ["a", null, "b", "gone"],
    asks: [[], [], ["a", "b", "gone"], []],
  };
  expect(limbHolders(presence, "b")).toEqual([
    { id: "a", name: "Aiko", colour: 0, mine: false },
    null,
    { id: "b", name: "You", colour: 1, mine: true },
    { id: "gone", name: "Someone", colour: 0, mine: false },
  ]);
  expect(limbHolders(null, "b")).toEqual([null, null, null, null]);
  expect(limbRequesters(presence, "b")).toEqual([
    [],
    [],
    [
      { id: "a", name: "Aiko", colour: 0 },
      { id: "gone", name: "Someone", colour: 0 },
    ],
    [],
  ]);
  expect(limbRequesters(null, "b")).toEqual([[], [], [], []]);
  // while the motion changes, the message may contain more or fewer limbs
  expect(
    limbHolders(presence, "b", 2)
      .slice(2)
      .map((holder) => holder?.id),
  ).toEqual(["b", "gone", undefined, undefined, undefined, undefined]);
  expect(limbRequesters(presence, "b", 2)).toHaveLength(8);
  expect(limbHolders({ ...presence, limbs: [...presence.limbs, "a"] }, "b")).toHaveLength(4);
});

test("keys 1 to 4 are right hand, left hand, right leg and left leg", () => {
  expect([1, 0, 3, 2].map(limbKey)).toEqual([1, 2, 3, 4]);
  expect([5, 4, 7, 6].map(limbKey)).toEqual([1, 2, 3, 4]);
});

test("limb names include the performer if there are several", () => {
  expect([limbName(0), limbName(0, 2), limbName(7, 2)]).toEqual([
    "left hand",
    "left hand of dancer 1",
    "right leg of dancer 2",
  ]);
  expect(limbsInKeyOrder(2)).toEqual([1, 0, 3, 2, 5, 4, 7, 6]);
  expect(performerCount(Array(12))).toBe(3);
});

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
