import * as fc from "fast-check";
import { expect, test } from "vitest";
import { AXIS_COUNT, EXPRESSIONS, expressionIndex, faceExpressionNames, faceExpressions } from "../../src/motion/face";
import { goldenHandsFaceTrack, handsFaceVectors } from "../golden-hands-face";

const golden = handsFaceVectors();

test("expressions are those of the vectors", () => {
  expect(EXPRESSIONS).toEqual(golden.expressions);
  expect(expressionIndex("jawOpen")).toBe(EXPRESSIONS.indexOf("jawOpen"));
  expect(expressionIndex("wink")).toBe(-1);
});

test.each(golden.faces)("golden expressions of track $track", (vector) => {
  const { content } = goldenHandsFaceTrack(golden.tracks[vector.track]);
  if (content.part !== "face") throw new Error("not a face");
  const out = new Float64Array(EXPRESSIONS.length);
  faceExpressions(content.face, Float64Array.from(vector.values), out);
  vector.weights.forEach((weight, n) => expect(Math.abs(out[n] - weight)).toBeLessThan(1e-12));
});

test("weights stay in range, and only named expressions move", () => {
  const axes = fc.uniqueArray(fc.nat(AXIS_COUNT - 1), { minLength: 1 }).map((found) => found.sort((a, b) => a - b));
  const value = fc.double({ min: -1e3, max: 1e3, noNaN: true });
  fc.assert(
    fc.property(axes, fc.array(value, { minLength: AXIS_COUNT, maxLength: AXIS_COUNT }), (found, values) => {
      const out = new Float64Array(EXPRESSIONS.length);
      faceExpressions({ axes: found }, Float64Array.from(values), out);
      const names = faceExpressionNames({ axes: found });
      out.forEach((weight, n) => {
        expect(Math.abs(weight)).toBeLessThanOrEqual(EXPRESSIONS[n].startsWith("gaze") ? Math.PI / 2 : 1);
        if (!names.includes(EXPRESSIONS[n])) expect(weight).toBe(0);
      });
    }),
  );
});
