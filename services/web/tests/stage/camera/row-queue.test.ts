import * as fc from "fast-check";
import { expect, test } from "vitest";
import { RowQueue } from "../../../src/stage/camera/row-queue";

test("rows equal those of a list that is pushed to, dropped from and cleared", () => {
  const step = fc.oneof(
    { weight: 8, arbitrary: fc.record({ push: fc.nat(300) }) },
    { weight: 2, arbitrary: fc.record({ drop: fc.nat(200) }) },
    { weight: 1, arbitrary: fc.constant({ clear: true }) },
  );
  fc.assert(
    fc.property(fc.array(step, { maxLength: 40 }), (steps) => {
      const rows = new RowQueue(2);
      let list: number[][] = [];
      let next = 0;
      for (const operation of steps) {
        if ("push" in operation) {
          for (let n = 0; n < operation.push; n++, next += 2) {
            rows.push([next, -next]);
            list.push([next, -next]);
          }
        } else if ("drop" in operation) {
          rows.drop(operation.drop);
          list = list.slice(operation.drop);
        } else {
          rows.clear();
          list = [];
        }
        expect(rows.length).toBe(list.length);
        expect(Array.from({ length: rows.length }, (_, index) => [...(rows.at(index) ?? [])])).toEqual(list);
        for (const max of [-1, next / 2, next / 2 + 1, next])
          expect(rows.countUpTo(max)).toBe(list.filter(([first]) => first <= max).length);
      }
    }),
  );
});

test("negative indices count from the end, and missing rows are null", () => {
  const rows = new RowQueue(1);
  expect([rows.at(0), rows.at(-1)]).toEqual([null, null]);
  for (const number of [1, 2, 3]) rows.push([number]);
  rows.drop(1);
  expect([rows.at(-1), rows.at(-2), rows.at(-3), rows.at(2)]).toEqual([
    Float64Array.of(3),
    Float64Array.of(2),
    null,
    null,
  ]);
});

test("a long-running queue takes at most twice its content's memory", () => {
  const rows = new RowQueue(8);
  let max = 0;
  for (let n = 0; n < 100_000; n++) {
    rows.push(new Float64Array(8).fill(n));
    if (rows.length > 1000) rows.drop(1);
    max = Math.max(max, rows.at(0)?.buffer.byteLength ?? 0);
  }
  expect([rows.at(0)?.[0], rows.at(-1)?.[7]]).toEqual([99_000, 99_999]);
  expect(max).toBeLessThanOrEqual(2048 * 8 * 8);
});
