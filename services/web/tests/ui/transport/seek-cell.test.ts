import fc from "fast-check";
import { describe, expect, test } from "vitest";
import { bufferedTo, qualityOf, seekCells } from "../../../src/ui/transport/seek-cell";

const blocks = fc.array(fc.integer({ min: -1, max: 3 }), { maxLength: 300 });

describe("seek cells", () => {
  test("one a block while they fit, coloured by rate", () => {
    expect(seekCells([3, 0, -1, 2], 4, 68)).toEqual([
      { quality: 3, start: 0, end: 0.25 },
      { quality: 0, start: 0.25, end: 0.5 },
      { quality: -1, start: 0.5, end: 0.75 },
      { quality: 2, start: 0.75, end: 1 },
    ]);
  });

  test("merged cells cover the motion without gap or overlap and never hide a missing block", () => {
    fc.assert(
      fc.property(blocks, fc.integer({ min: 1, max: 68 }), (held, most) => {
        const cells = seekCells(held, 4, most);
        expect(cells.length).toBe(Math.min(held.length, most));
        cells.forEach((cell, i) => {
          expect(cell.start).toBe(i === 0 ? 0 : cells[i - 1].end);
          const inside = held.slice(Math.round(cell.start * held.length), Math.round(cell.end * held.length));
          expect(cell.quality).toBe(qualityOf(Math.min(...inside), 4));
        });
        if (cells.length > 0) expect(cells[cells.length - 1].end).toBe(1);
      }),
    );
  });

  test("rates spread over the four qualities", () => {
    expect([0, 1, 2].map((rate) => qualityOf(rate, 3))).toEqual([0, 2, 3]);
    expect(qualityOf(0, 1)).toBe(3);
    expect(qualityOf(-1, 1)).toBe(-1);
  });

  test("buffered up to the first missing block, never behind the position", () => {
    expect(bufferedTo([0, 0, 0, -1, 0], 1.5, 5)).toBe(3);
    expect(bufferedTo([0, 0, 0, -1, 0], 3.5, 5)).toBe(3.5);
    expect(bufferedTo([0, 0], 1.5, 2)).toBe(2);
    expect(bufferedTo([], 0, 0)).toBe(0);
  });
});
