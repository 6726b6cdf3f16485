import { expect, test } from "vitest";
import { changedParts } from "../../src/engine/changed-parts";

const STATE = { isPulling: false, faces: [{ left: 1, right: 2 }], label: null as { top: number } | null, time: NaN };

test("everything has changed before the first state", () => {
  expect(changedParts(null, STATE)).toEqual(STATE);
});

test("an equal state has no changes", () => {
  expect(changedParts(STATE, structuredClone(STATE))).toBe(null);
});

test("only members that differ are returned, whole", () => {
  const label = { top: 3 };
  expect(changedParts(STATE, { ...STATE, isPulling: true, label })).toEqual({ isPulling: true, label });
  expect(changedParts({ ...STATE, label }, STATE)).toEqual({ label: null });
});

test("elements and lengths of lists are compared", () => {
  const [face] = STATE.faces;
  for (const faces of [[], [face, face], [{ ...face, right: 3 }]])
    expect(changedParts(STATE, { ...STATE, faces })).toEqual({ faces });
});
