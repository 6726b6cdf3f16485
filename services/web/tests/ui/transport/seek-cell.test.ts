import fc from "fast-check";
import { describe, expect, test } from "vitest";
import { bufferedTo, qualityOf, seekCells } from "../../../src/ui/transport/seek-cell";

const blocks = fc.array(fc.integer({ min: -1, max: 3 }), { maxLength: 300 });

describe("seek cells", () => {
  test("one cell per block while they fit, coloured by bitrate level", () => {
    expect(seekCells([3, 0, -1, 2], 4, 68)).toEqual([
      { quality: 3, start: 0, end: 0.25 },
      { quality: 0, start: 0.25, end: 0.5 },
      { quality: -1, start: 0.5, end: 0.75 },
      { quality: 2, start: 0.75, end: 1 },
    ]);
  });

  test("merged cells cover the motion and never hide a missing block", () => {
    fc.assert(
      fc.property(blocks, fc.integer({ min: 1, max: 68 }), (levels, maxCells) => {
        const cells = seekCells(levels, 4, maxCells);
        expect(cells.length).toBe(Math.min(levels.length, maxCells));
        cells.forEach((cell, i) => {
          expect(cell.start).toBe(i === 0 ? 0 : cells[i - 1].end);
          const inside = levels.slice(Math.round(cell.start * levels.length), Math.round(cell.end * levels.length));
          expect(cell.quality).toBe(qualityOf(Math.min(...inside), 4));
        });
        if (cells.length > 0) expect(cells[cells.length - 1].end).toBe(1);
      }),
    );
  });

  test("levels are spread over the four qualities", () => {
    expect([0, 1, 2].map((level) => qualityOf(level, 3))).toEqual([0, 2, 3]);
    expect(qualityOf(0, 1)).toBe(3);
    expect(qualityOf(-1, 1)).toBe(-1);
  });

  test("buffered time ends at the first missing block, not before the position", () => {
    expect(bufferedTo([0, 0, 0, -1, 0], 1.5, 5)).toBe(3);
    expect(bufferedTo([0, 0, 0, -1, 0], 3.5, 5)).toBe(3.5);
    expect(bufferedTo([0, 0], 1.5, 2)).toBe(2);
    expect(bufferedTo([], 0, 0)).toBe(0);
  });
});
