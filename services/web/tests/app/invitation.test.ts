import { Vector3 } from "three";
import { expect, test } from "vitest";
import { Invitation } from "../../src/app/invitation";

function begin(kept: Record<string, string> = {}) {
  const told: ({ x: number; y: number } | null)[] = [];
  const store = {
    get: (key: string) => kept[key] ?? null,
    put: (key: string, text: string) => void (kept[key] = text),
  };
  const inviting = new Invitation({ invite: (place) => void told.push(place) }, store);
  const stage = {
    hand: new Vector3(1, 2, 3) as Vector3 | null,
    nearerHand: () => stage.hand,
    toScreen: ({ x, y }: Vector3) => ({ x: 100 * x, y: 100 * y }),
  };
  return { inviting, stage, told, kept };
}

test("an invitation stands by the nearer hand for six seconds, and then never again", () => {
  const { inviting, stage, told, kept } = begin();
  inviting.update(50_000, stage);
  inviting.update(56_000, stage);
  expect(told).toEqual([
    { x: 100, y: 200 },
    { x: 100, y: 200 },
  ]);
  inviting.update(56_001, stage);
  inviting.update(56_020, stage);
  expect(told.slice(2)).toEqual([null]);
  const next = begin(kept);
  next.inviting.update(0, next.stage);
  expect(next.told).toEqual([]);
});

test("it is over once a limb was taken, also before it was seen", () => {
  const { inviting, stage, told, kept } = begin();
  inviting.finish();
  inviting.finish();
  inviting.update(0, stage);
  expect(told).toEqual([null]);
  expect(Object.values(kept)).toEqual(["yes"]);
});

test("while there is no hand to be seen it stands nowhere", () => {
  const { inviting, stage, told } = begin();
  stage.hand = null;
  inviting.update(0, stage);
  expect(told).toEqual([null]);
});
