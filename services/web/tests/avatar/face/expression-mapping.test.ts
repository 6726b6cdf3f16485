import fc from "fast-check";
import { expect, test } from "vitest";
import { ExpressionMapping } from "../../../src/avatar/face/expression-mapping";
import { EMOTION_PRESETS, MOUTH_PRESETS } from "../../../src/avatar/face/expression-rules";
import { EXPRESSIONS, faceExpressionNames, GAZE } from "../../../src/motion/face";
import { faceOf } from "./faces";

const NAMES = EXPRESSIONS.filter((name) => !GAZE.includes(name) && !name.startsWith("look"));
const PRESETS = ["happy", "angry", "sad", "relaxed", "surprised", ...MOUTH_PRESETS, "blink", "blinkLeft", "blinkRight"];
const ARKIT = NAMES.filter((name) => !PRESETS.includes(name) && name !== "neutral");

/** Return the weights of an avatar's expressions above 0 by name, for the weights of a face. */
function show(weights: Record<string, number>, targets: readonly string[]): Record<string, number> {
  const pose = faceOf(weights);
  const out = new Float64Array(targets.length).fill(-1);
  const mapping = new ExpressionMapping(faceExpressionNames(pose.face), targets);
  mapping.apply(pose.weights, out);
  return Object.fromEntries(
    mapping.written
      .filter((target) => out[target] > 0)
      .map((target) => [targets[target], Math.round(out[target] * 1e6) / 1e6]),
  );
}

test("an expression that the avatar has shows as it is", () => {
  expect(show({ jawOpen: 0.4, mouthSmileLeft: 0.3, happy: 0.2 }, [...ARKIT, ...PRESETS])).toEqual({
    jawOpen: 0.4,
    mouthSmileLeft: 0.3,
    happy: 0.2,
  });
});

test("blend shapes show as presets on an avatar without them", () => {
  expect(show({ eyeBlinkLeft: 1, eyeBlinkRight: 0.2 }, PRESETS)).toEqual({ blinkLeft: 1, blinkRight: 0.2 });
  expect(show({ jawOpen: 0.8 }, PRESETS)).toEqual({ aa: 0.8 });
  expect(show({ jawOpen: 0.8, mouthClose: 0.8 }, PRESETS)).toEqual({});
  expect(show({ mouthFunnel: 1, jawOpen: 1 }, PRESETS)).toEqual({ oh: 1 });
  expect(show({ mouthPucker: 1 }, PRESETS)).toEqual({ ou: 1 });
  expect(show({ mouthStretchLeft: 1, mouthStretchRight: 1 }, PRESETS)).toEqual({ ee: 1 });
  expect(show({ mouthSmileLeft: 1, mouthSmileRight: 1 }, PRESETS)).toEqual({ happy: 1 });
  expect(show({ mouthSmileLeft: 0.5, mouthSmileRight: 0.5 }, PRESETS)).toEqual({ happy: 0.25, relaxed: 0.25 });
  expect(show({ browDownLeft: 1, browDownRight: 1 }, PRESETS)).toEqual({ angry: 0.6 });
  expect(show({ mouthFrownLeft: 1, mouthFrownRight: 1 }, PRESETS)).toEqual({ sad: 1 });
  expect(
    show({ eyeWideLeft: 1, eyeWideRight: 1, browOuterUpLeft: 1, browOuterUpRight: 1, browInnerUp: 1 }, PRESETS),
  ).toEqual({
    surprised: 1,
  });
});

test("presets show as blend shapes on an avatar that has only those", () => {
  expect(show({ blink: 0.7 }, ARKIT)).toEqual({ eyeBlinkLeft: 0.7, eyeBlinkRight: 0.7 });
  expect(show({ blinkRight: 0.7 }, ARKIT)).toEqual({ eyeBlinkRight: 0.7 });
  expect(show({ aa: 1 }, ARKIT)).toEqual({ jawOpen: 0.7, mouthLowerDownLeft: 0.2, mouthLowerDownRight: 0.2 });
  expect(Object.keys(show({ surprised: 1, angry: 1 }, ARKIT))).toEqual(
    expect.arrayContaining(["jawOpen", "browInnerUp", "browDownLeft", "eyeWideRight"]),
  );
});

test("an avatar that cannot wink closes its eyes only when both are closed", () => {
  expect(show({ eyeBlinkLeft: 1, eyeBlinkRight: 0 }, ["blink"])).toEqual({});
  expect(show({ eyeBlinkLeft: 1, eyeBlinkRight: 0.9 }, ["blink"])).toEqual({ blink: 0.9 });
  expect(show({ blinkLeft: 0.5, blinkRight: 0.5 }, ["blink"])).toEqual({ blink: 0.5 });
});

test("a preset that is missing shows in a similar one", () => {
  expect(show({ mouthFunnel: 1, jawOpen: 0 }, ["aa"])).toEqual({ aa: 0.2 });
  expect(show({ oh: 1 }, ["aa"])).toEqual({ aa: 0.5 });
  expect(show({ mouthSmileLeft: 0.5, mouthSmileRight: 0.5 }, ["happy"])).toEqual({ happy: 0.5 });
});

test("a blink is not shown twice by an eye that has a preset and a blend shape", () => {
  expect(show({ blink: 1 }, ["blinkLeft", "blinkRight", "eyeBlinkLeft", "eyeBlinkRight"])).toEqual({
    blinkLeft: 1,
    blinkRight: 1,
  });
});

test("weights are 0 to 1, and those of mouth shapes and of derived emotions at most 1 in sum", () => {
  const weight = fc.double({ min: 0, max: 1, noNaN: true });
  fc.assert(
    fc.property(
      fc.dictionary(fc.constantFrom(...NAMES), weight, { minKeys: 1, maxKeys: 20 }),
      fc.uniqueArray(fc.constantFrom(...NAMES), { maxLength: 40 }),
      (weights, targets) => {
        const pose = faceOf(weights);
        const known = faceExpressionNames(pose.face);
        const out = new Float64Array(targets.length);
        new ExpressionMapping(known, targets).apply(pose.weights, out);
        expect(out.every((value) => value >= 0 && value <= 1)).toBe(true);
        const sum = (names: readonly string[]) =>
          names.reduce((total, name) => total + (targets.includes(name) ? out[targets.indexOf(name)] : 0), 0);
        expect(sum(MOUTH_PRESETS)).toBeLessThan(1 + 1e-9);
        if (!EMOTION_PRESETS.some((name) => known.includes(name))) expect(sum(EMOTION_PRESETS)).toBeLessThan(1 + 1e-9);
      },
    ),
  );
});
