import fc from "fast-check";
import { describe, expect, test } from "vitest";
import { areaPath, niceScaleMax, PLOT_HEIGHT, PLOT_WIDTH, tracePath } from "../../../src/ui/link/plot";
import { SampleHistory } from "../../../src/ui/link/sample-history";

const samples = fc.array(fc.double({ min: 0, max: 1e6, noNaN: true }), { minLength: 1, maxLength: 120 });

describe("plots", () => {
  test("history drops its oldest sample", () => {
    const history = new SampleHistory(3);
    for (const value of [1, 2, 3, 4]) history.push(value);
    expect(history.values).toEqual([2, 3, 4]);
  });

  test("scale is a round number above every value", () => {
    fc.assert(
      fc.property(samples, (values) => {
        const top = niceScaleMax(values, 1);
        expect(top).toBeGreaterThanOrEqual(Math.max(...values) * 0.998);
        expect([1, 2, 5, 10]).toContain(Number((top / 10 ** Math.floor(Math.log10(top) + 1e-9)).toPrecision(3)));
      }),
    );
  });

  test("newest sample is at the right edge and all are inside the frame", () => {
    fc.assert(
      fc.property(samples, (values) => {
        const points = tracePath(values, 120, niceScaleMax(values, 1))
          .split(/[ML]/)
          .slice(1)
          .map((point) => point.split(" ").map(Number));
        expect(points).toHaveLength(values.length);
        expect(points[points.length - 1][0]).toBeCloseTo(PLOT_WIDTH, 1);
        for (const [x, y] of points) {
          expect(x >= 0 && x <= PLOT_WIDTH && y >= 0 && y <= PLOT_HEIGHT).toBe(true);
        }
      }),
    );
  });

  test("gaps stay open in lines and areas", () => {
    const values = [1, 1, Number.NaN, 1, 1];
    expect(tracePath(values, 5, 1).match(/M/g)).toHaveLength(2);
    expect(areaPath(values, 5, 1).match(/Z/g)).toHaveLength(2);
    expect(areaPath([Number.NaN], 5, 1)).toBe("");
  });
});
