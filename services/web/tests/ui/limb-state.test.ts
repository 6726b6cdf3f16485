import { expect, test } from "vitest";
import {
  limbHolders,
  limbKey,
  limbName,
  limbRequesters,
  limbsInKeyOrder,
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
