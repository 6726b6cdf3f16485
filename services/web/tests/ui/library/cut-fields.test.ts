import { expect, test } from "vitest";
import { editOf } from "../../../src/ui/library/cut-fields";

const WHOLE = { start: 0, end: 12.5, mirror: false, loop: false };

test("edit contains only what changes the motion, in microseconds", () => {
  expect(editOf({ ...WHOLE, start: 1.25 }, 12.5)).toEqual({ start: 1_250_000 });
  expect(editOf({ ...WHOLE, end: 8, mirror: true }, 12.5)).toEqual({ end: 8_000_000, mirror: true });
  expect(editOf({ start: 2, end: 3, mirror: false, loop: true }, 12.5)).toEqual({
    start: 2_000_000,
    end: 3_000_000,
    loop: true,
  });
});

test("there is no edit without an effect or with an empty part", () => {
  expect(editOf(WHOLE, 12.5)).toBeNull();
  // A slider ends at its last step, which may be before the end of the motion.
  expect(editOf({ ...WHOLE, end: 12.499 }, 12.5)).toBeNull();
  expect(editOf({ ...WHOLE, start: 5, end: 5 }, 12.5)).toBeNull();
});
