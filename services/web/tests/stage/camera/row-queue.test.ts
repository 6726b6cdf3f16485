import * as fc from "fast-check";
import { expect, test } from "vitest";
import { RowQueue } from "../../../src/stage/camera/row-queue";

test("rows are those of a list that is pushed to, dropped from and cleared", () => {
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
      for (const one of steps) {
        if ("push" in one) {
          for (let n = 0; n < one.push; n++, next += 2) {
            rows.push([next, -next]);
            list.push([next, -next]);
          }
        } else if ("drop" in one) {
          rows.drop(one.drop);
          list = list.slice(one.drop);
        } else {
          rows.clear();
          list = [];
        }
        expect(rows.length).toBe(list.length);
        expect(Array.from({ length: rows.length }, (_, nth) => [...(rows.at(nth) ?? [])])).toEqual(list);
        for (const most of [-1, next / 2, next / 2 + 1, next])
          expect(rows.countUpTo(most)).toBe(list.filter(([first]) => first <= most).length);
      }
    }),
  );
});

test("from the end they are counted below zero, and beyond there is none", () => {
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

test("a queue that goes through it for long takes no more than twice what is in it at once", () => {
  const rows = new RowQueue(8);
  let most = 0;
  for (let n = 0; n < 100_000; n++) {
    rows.push(new Float64Array(8).fill(n));
    if (rows.length > 1000) rows.drop(1);
    most = Math.max(most, rows.at(0)?.buffer.byteLength ?? 0);
  }
  expect([rows.at(0)?.[0], rows.at(-1)?.[7]]).toEqual([99_000, 99_999]);
  expect(most).toBeLessThanOrEqual(2048 * 8 * 8);
});
