import { expect, test } from "vitest";
import { askers, holders, limbKey } from "../../src/page/model";

test("holders by limb: oneself is You, strangers have their name and colour; and those who ask, without oneself", () => {
  const presence = {
    name: "Presence" as const,
    viewers: 2,
    puppeteers: [{ id: "a", name: "Aiko", colour: 0 }, { id: "b", name: "Mateo", colour: 1 }],
    limbs: ["a", null, "b", "gone"],
    asks: [[], [], ["a", "b", "gone"], []],
  };
  expect(holders(presence, "b")).toEqual([
    { id: "a", name: "Aiko", colour: 0, mine: false },
    null,
    { id: "b", name: "You", colour: 1, mine: true },
    { id: "gone", name: "Someone", colour: 0, mine: false },
  ]);
  expect(holders(null, "b")).toEqual([null, null, null, null]);
  expect(askers(presence, "b")).toEqual([[], [], [{ id: "a", name: "Aiko", colour: 0 }, { id: "gone", name: "Someone", colour: 0 }], []]);
  expect(askers(null, "b")).toEqual([[], [], [], []]);
});

test("keys 1 to 4 are right hand, left hand, right leg, left leg", () => {
  expect([1, 0, 3, 2].map(limbKey)).toEqual([1, 2, 3, 4]);
});
