import { Vector3 } from "three";
import { expect, test } from "vitest";
import { Invitation } from "../../src/app/invitation";

function createInvitation(stored: Record<string, string> = {}) {
  const shown: ({ x: number; y: number } | null)[] = [];
  const storage = {
    get: (key: string) => stored[key] ?? null,
    put: (key: string, text: string) => void (stored[key] = text),
  };
  const invitation = new Invitation({ invite: (point) => void shown.push(point) }, storage);
  const stage = {
    hand: new Vector3(1, 2, 3) as Vector3 | null,
    nearerHand: () => stage.hand,
    toScreen: ({ x, y }: Vector3) => ({ x: 100 * x, y: 100 * y }),
  };
  return { invitation, stage, shown, stored };
}

test("invitation is shown beside the nearer hand for six seconds, once", () => {
  const { invitation, stage, shown, stored } = createInvitation();
  invitation.update(50_000, stage);
  invitation.update(56_000, stage);
  expect(shown).toEqual([
    { x: 100, y: 200 },
    { x: 100, y: 200 },
  ]);
  invitation.update(56_001, stage);
  invitation.update(56_020, stage);
  expect(shown.slice(2)).toEqual([null]);
  const next = createInvitation(stored);
  next.invitation.update(0, next.stage);
  expect(next.shown).toEqual([]);
});

test("invitation ends when a limb is claimed, even before it was shown", () => {
  const { invitation, stage, shown, stored } = createInvitation();
  invitation.finish();
  invitation.finish();
  invitation.update(0, stage);
  expect(shown).toEqual([null]);
  expect(Object.values(stored)).toEqual(["yes"]);
});

test("invitation is hidden without a visible hand", () => {
  const { invitation, stage, shown } = createInvitation();
  stage.hand = null;
  invitation.update(0, stage);
  expect(shown).toEqual([null]);
});
