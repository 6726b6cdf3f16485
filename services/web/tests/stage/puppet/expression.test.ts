import fc from "fast-check";
import { Texture } from "three";
import { describe, expect, test } from "vitest";
import { AXIS_COUNT, EXPRESSIONS, expressionIndex, type FacePose } from "../../../src/motion/face";
import { restPose } from "../../../src/motion/skeleton";
import { FaceExpression, MOVEMENTS } from "../../../src/stage/puppet/face/expression";
import { Puppet, setPuppetExtension } from "../../../src/stage/puppet/puppet";
import { PuppetAssets } from "../../../src/stage/puppet/puppet-assets";
import { PuppetExtension } from "../../../src/stage/puppet/puppet-extension";
import { createStandardFigure } from "./figures";

setPuppetExtension(PuppetExtension);
const ALL = { axes: Array.from({ length: AXIS_COUNT }, (_, axis) => axis) };
/** Face without axes of the eyelids. */
const MOUTH_ONLY = { axes: [1] };

function createFace(weights: Readonly<Record<string, number>>, face = ALL): FacePose {
  const pose = { face, weights: new Float64Array(EXPRESSIONS.length) };
  for (const [name, weight] of Object.entries(weights)) pose.weights[expressionIndex(name)] = weight;
  return pose;
}

/** Return the movements that are not 0. */
function moved(pose: FacePose | null, blink = 0): Record<string, number> {
  const movements = new FaceExpression().update(pose, blink);
  return Object.fromEntries(
    MOVEMENTS.flatMap((name, at) => (movements[at] === 0 ? [] : [[name, Number(movements[at].toFixed(9))]])),
  );
}

describe("the expression", () => {
  test("is the painted face at rest", () => {
    expect(MOVEMENTS).toHaveLength(16);
    expect(moved(null)).toEqual({});
    expect(moved(createFace({}))).toEqual({});
    expect(moved(createFace({ neutral: 1 }))).toEqual({});
  });

  test.each<[string, Record<string, number>, Record<string, number>]>([
    ["one eye", { eyeBlinkLeft: 1 }, { leftLid: 1 }],
    ["both eyes of a preset", { blink: 0.5 }, { leftLid: 0.5, rightLid: 0.5 }],
    ["one eye of a preset", { blinkRight: 1 }, { rightLid: 1 }],
    ["wide eyes", { eyeWideLeft: 1 }, { leftLid: -1 }],
    ["eyes to the left", { eyeLookOutLeft: 1, eyeLookInRight: 1 }, { leftIrisX: 1, rightIrisX: 1 }],
    ["eyes to the right", { lookRight: 0.5 }, { leftIrisX: -0.5, rightIrisX: -0.5 }],
    ["a gaze", { gazeYaw: 0.3 }, { leftIrisX: 0.501, rightIrisX: 0.501 }],
    ["a raised brow", { browOuterUpRight: 1 }, { rightBrowIn: 0.1, rightBrowOut: 1 }],
    ["an open mouth", { jawOpen: 0.7 }, { jaw: 0.7 }],
    ["lips that stay closed", { jawOpen: 0.7, mouthClose: 1 }, {}],
    ["half a smile", { mouthSmileLeft: 1 }, { leftCorner: 1, mouth: 0.075 }],
    ["a smile", { mouthSmileLeft: 1, mouthSmileRight: 1 }, { leftCorner: 1, rightCorner: 1, mouth: 0.15 }],
    ["a vowel", { ou: 1 }, { jaw: 0.4, mouth: -1 }],
  ])("has %s", (_, weights, movements) => {
    expect(moved(createFace(weights))).toEqual(movements);
  });

  test("has lids that follow eyes looking down", () => {
    expect(moved(createFace({ eyeLookDownLeft: 1 }))).toEqual({ leftIrisY: -1, leftLid: 0.35 });
  });

  test("blinks by itself unless the face has lids", () => {
    expect(moved(null, 1)).toEqual({ leftLid: 1, rightLid: 1 });
    expect(moved(createFace({ jawOpen: 1 }, MOUTH_ONLY), 0.5)).toEqual({ leftLid: 0.5, rightLid: 0.5, jaw: 1 });
    expect(moved(createFace({ jawOpen: 1 }), 1)).toEqual({ jaw: 1 });
  });

  test("has a movement for every expression that a carved face can show", () => {
    const without = EXPRESSIONS.filter(
      (name) => Object.keys(moved(createFace({ [name]: 0.4, jawOpen: 0.5 }))).length < 2,
    );
    const unshown =
      /^(jaw(Open|Forward|Left|Right)|mouth(Close|Roll|Shrug|Press|Left|Right|LowerDown|UpperUp)|cheekPuff|tongueOut|neutral|aa)/;
    expect(without.filter((name) => !unshown.test(name))).toEqual([]);
  });

  test("stays within bounds for any weights", () => {
    const weight = fc.double({ min: -2, max: 2 });
    fc.assert(
      fc.property(
        fc.array(weight, { minLength: EXPRESSIONS.length, maxLength: EXPRESSIONS.length }),
        fc.double({ min: 0, max: 1, noNaN: true }),
        (weights, blink) => {
          const movements = new FaceExpression().update({ face: ALL, weights: Float64Array.from(weights) }, blink);
          for (const value of movements) expect(Math.abs(value)).toBeLessThanOrEqual(1);
          for (const name of ["leftLower", "rightLower", "jaw"] as const)
            expect(movements[MOVEMENTS.indexOf(name)]).toBeGreaterThanOrEqual(0);
        },
      ),
    );
  });
});

test("the face of one puppet does not change another's, and returns to rest", () => {
  const assets = new PuppetAssets({ face: new Texture(), asanoha: new Texture() }, { value: 0 });
  const [first, second] = [0, 1].map(() => new Puppet(createStandardFigure(), assets));
  const elementsOf = (puppet: Puppet) => puppet.group.getObjectByName("face")?.matrixWorld.elements;
  const zeros = new Array<number>(16).fill(0);
  first.apply({ ...restPose(), face: createFace({ happy: 1 }) }, 0);
  second.apply(restPose(), 0);
  expect(elementsOf(first)).not.toEqual(zeros);
  expect(elementsOf(second)).toEqual(zeros);
  for (const puppet of [first, second]) puppet.group.updateMatrixWorld(true);
  expect(elementsOf(second)).toEqual(zeros);
  first.apply(restPose(), 0);
  expect(elementsOf(first)).toEqual(zeros);
});
