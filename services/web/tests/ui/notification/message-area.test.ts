import { describe, expect, test } from "vitest";
import type { ScreenBox } from "../../../src/stage/camera/screen-box";
import { belongsAtBottom } from "../../../src/ui/notification/message-area";

const box = (top: number, bottom: number): ScreenBox => ({ left: 300, top, right: 700, bottom });
const face = (y: number): ScreenBox => ({ left: 480, top: y - 30, right: 520, bottom: y + 30 });

const PLACES = [box(80, 120), box(450, 490)] as const;

describe("messages", () => {
  test("stand at the head where no face is", () => {
    expect(belongsAtBottom(false, PLACES, [])).toBe(false);
    expect(belongsAtBottom(false, PLACES, [face(200)], true)).toBe(false);
  });

  test("stand at the foot where they would cover one at the head, or come near it as they begin", () => {
    expect(belongsAtBottom(false, PLACES, [face(130)])).toBe(true);
    expect(belongsAtBottom(false, PLACES, [face(160)], true)).toBe(true);
    expect(belongsAtBottom(false, PLACES, [face(160)])).toBe(false);
  });

  test("do not go back while they are there, unless a face comes", () => {
    expect(belongsAtBottom(true, PLACES, [face(300)])).toBe(true);
    expect(belongsAtBottom(true, PLACES, [face(430)])).toBe(false);
  });

  test("stay where neither place is free", () => {
    for (const low of [false, true]) expect(belongsAtBottom(low, PLACES, [face(100), face(470)], true)).toBe(low);
  });

  test("pass a face by that is beside them", () => {
    expect(belongsAtBottom(false, PLACES, [{ left: 750, top: 90, right: 790, bottom: 150 }], true)).toBe(false);
  });
});
