import { describe, expect, test } from "vitest";
import type { ScreenBox } from "../../../src/stage/camera/screen-box";
import { belongsAtBottom } from "../../../src/ui/notification/message-area";

const box = (top: number, bottom: number): ScreenBox => ({ left: 300, top, right: 700, bottom });
const face = (y: number): ScreenBox => ({ left: 480, top: y - 30, right: 520, bottom: y + 30 });

const POSITIONS = [box(80, 120), box(450, 490)] as const;

describe("messages", () => {
  test("are at the top if no face is there", () => {
    expect(belongsAtBottom(false, POSITIONS, [])).toBe(false);
    expect(belongsAtBottom(false, POSITIONS, [face(200)], true)).toBe(false);
  });

  test("are at the bottom if they would cover a face, or start near one", () => {
    expect(belongsAtBottom(false, POSITIONS, [face(130)])).toBe(true);
    expect(belongsAtBottom(false, POSITIONS, [face(160)], true)).toBe(true);
    expect(belongsAtBottom(false, POSITIONS, [face(160)])).toBe(false);
  });

  test("stay at the bottom unless a face comes there", () => {
    expect(belongsAtBottom(true, POSITIONS, [face(300)])).toBe(true);
    expect(belongsAtBottom(true, POSITIONS, [face(430)])).toBe(false);
  });

  test("stay where they are if neither position is free", () => {
    for (const atBottom of [false, true])
      expect(belongsAtBottom(atBottom, POSITIONS, [face(100), face(470)], true)).toBe(atBottom);
  });

  test("ignore a face beside them", () => {
    expect(belongsAtBottom(false, POSITIONS, [{ left: 750, top: 90, right: 790, bottom: 150 }], true)).toBe(false);
  });
});
