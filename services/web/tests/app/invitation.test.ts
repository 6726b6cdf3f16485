import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { Invitation } from "../../src/app/invitation";

beforeEach(() => void vi.useFakeTimers());
afterEach(() => void vi.useRealTimers());

function createInvitation(stored: Record<string, string> = {}) {
  const shown: boolean[] = [];
  const storage = {
    get: (key: string) => stored[key] ?? null,
    put: (key: string, text: string) => void (stored[key] = text),
  };
  let onShown: (() => void) | null = null;
  const tags = {
    invite(callback: () => void) {
      shown.push(true);
      onShown = callback;
    },
    endInvitation: () => void shown.push(false),
  };
  return { invitation: new Invitation(tags, storage), shown, stored, place: () => onShown?.() };
}

test("invitation is shown for six seconds, once", () => {
  const { invitation, shown, stored, place } = createInvitation();
  invitation.start();
  place();
  vi.advanceTimersByTime(3_000);
  invitation.start();
  vi.advanceTimersByTime(2_999);
  expect(shown).toEqual([true]);
  vi.advanceTimersByTime(1);
  expect(shown).toEqual([true, false]);
  invitation.start();
  vi.advanceTimersByTime(10_000);
  expect(shown).toEqual([true, false]);
  const next = createInvitation(stored);
  next.invitation.start();
  expect(next.shown).toEqual([]);
});

test("duration of the invitation begins when it has a position", () => {
  const { invitation, shown, place } = createInvitation();
  invitation.start();
  vi.advanceTimersByTime(60_000);
  expect(shown).toEqual([true]);
  place();
  vi.advanceTimersByTime(5_999);
  expect(shown).toEqual([true]);
  vi.advanceTimersByTime(1);
  expect(shown).toEqual([true, false]);
});

test("invitation ends when a limb is claimed, even before it was shown", () => {
  const { invitation, shown, stored } = createInvitation();
  invitation.finish();
  invitation.finish();
  invitation.start();
  vi.advanceTimersByTime(10_000);
  expect(shown).toEqual([false]);
  expect(Object.values(stored)).toEqual(["yes"]);
});

test("a limb that is claimed while the invitation is shown ends it at once", () => {
  const { invitation, shown, place } = createInvitation();
  invitation.start();
  place();
  invitation.finish();
  vi.advanceTimersByTime(10_000);
  expect(shown).toEqual([true, false]);
});
