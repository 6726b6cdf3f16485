import { expect, test } from "vitest";
import { Invitation } from "../../src/app/invitation";

function createInvitation(stored: Record<string, string> = {}) {
  const shown: ({ x: number; y: number } | null)[] = [];
  const storage = {
    get: (key: string) => stored[key] ?? null,
    put: (key: string, text: string) => void (stored[key] = text),
  };
  const invitation = new Invitation({ invite: (point) => void shown.push(point) }, storage);
  return { invitation, shown, stored };
}

const HAND = { x: 100, y: 200 };

test("invitation is shown beside the nearer hand for six seconds, once", () => {
  const { invitation, shown, stored } = createInvitation();
  invitation.update(50_000, HAND);
  invitation.update(56_000, HAND);
  expect(shown).toEqual([HAND, HAND]);
  invitation.update(56_001, HAND);
  invitation.update(56_020, HAND);
  expect(shown.slice(2)).toEqual([null]);
  const next = createInvitation(stored);
  next.invitation.update(0, HAND);
  expect(next.shown).toEqual([]);
});

test("invitation ends when a limb is claimed, even before it was shown", () => {
  const { invitation, shown, stored } = createInvitation();
  invitation.finish();
  invitation.finish();
  invitation.update(0, HAND);
  expect(shown).toEqual([null]);
  expect(Object.values(stored)).toEqual(["yes"]);
});

test("invitation is hidden without a visible hand", () => {
  const { invitation, shown } = createInvitation();
  invitation.update(0, null);
  expect(shown).toEqual([null]);
});
