import { describe, expect, test } from "vitest";
import { standsLow } from "../../src/page/messages";
import type { Box } from "../../src/stage/boxes";

const box = (top: number, bottom: number): Box => ({ left: 300, top, right: 700, bottom });
const face = (y: number): Box => ({ left: 480, top: y - 30, right: 520, bottom: y + 30 });

const PLACES = [box(80, 120), box(450, 490)] as const;

describe("messages", () => {
  test("stand at the head where no face is", () => {
    expect(standsLow(false, PLACES, [])).toBe(false);
    expect(standsLow(false, PLACES, [face(200)], true)).toBe(false);
  });

  test("stand at the foot where they would cover one at the head, or come near it as they begin", () => {
    expect(standsLow(false, PLACES, [face(130)])).toBe(true);
    expect(standsLow(false, PLACES, [face(160)], true)).toBe(true);
    expect(standsLow(false, PLACES, [face(160)])).toBe(false);
  });

  test("do not go back while they are there, unless a face comes", () => {
    expect(standsLow(true, PLACES, [face(300)])).toBe(true);
    expect(standsLow(true, PLACES, [face(430)])).toBe(false);
  });

  test("stay where neither place is free", () => {
    for (const low of [false, true]) expect(standsLow(low, PLACES, [face(100), face(470)], true)).toBe(low);
  });

  test("pass a face by that is beside them", () => {
    expect(standsLow(false, PLACES, [{ left: 750, top: 90, right: 790, bottom: 150 }], true)).toBe(false);
  });
});
