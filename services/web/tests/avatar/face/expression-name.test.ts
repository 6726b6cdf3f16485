import { expect, test } from "vitest";
import { expressionOfName } from "../../../src/avatar/face/expression-name";
import { EXPRESSIONS, GAZE } from "../../../src/motion/face";
import { loadVectors } from "../../golden-vectors";

const { expressions } = loadVectors<{ expressions: Readonly<Record<string, string | null>> }>("hand_face_names");

test("names mean the expressions that they mean to the server", () => {
  expect(Object.keys(expressions).length).toBeGreaterThan(500);
  // Morph targets have no angles, so that an avatar's are none of the gaze.
  const expected = (name: string | null) => (name !== null && GAZE.includes(name) ? null : name);
  for (const [name, meant] of Object.entries(expressions))
    expect([name, expressionOfName(name)]).toEqual([name, expected(meant)]);
});

test.each([
  ["eyeBlinkLeft", "eyeBlinkLeft"],
  ["EYEBLINKLEFT", "eyeBlinkLeft"],
  ["eyeBlink_L", "eyeBlinkLeft"],
  ["head.mouthSmile.R", "mouthSmileRight"],
  ["Face_JawOpen", "jawOpen"],
  ["blendShape1.mouthLowerDown_L", "mouthLowerDownLeft"],
  ["A", "aa"],
  ["viseme_O", "oh"],
  ["vrc.v_ou", "ou"],
  ["blendShape16.vrc_blink", "blink"],
  ["blendShape1.vrc_v_aa", "aa"],
  ["Fcl_EYE_Close_R", "blinkRight"],
  ["Joy", "happy"],
  ["まばたき", "blink"],
  ["ウィンク右", "blinkRight"],
  ["HideHairBalls", null],
  ["left", null],
  ["", null],
  ["gazeYaw", null],
])("%s is %s", (name, expected) => {
  expect(expressionOfName(name)).toBe(expected);
});

test("every expression is found by its own name in any case", () => {
  for (const name of EXPRESSIONS.filter((one) => !GAZE.includes(one)))
    for (const spelled of [
      name,
      name.toUpperCase(),
      `mesh.${name}`,
      name.replace(/Left$/, "_L").replace(/Right$/, "_R"),
    ])
      expect(expressionOfName(spelled)).toBe(name);
});
