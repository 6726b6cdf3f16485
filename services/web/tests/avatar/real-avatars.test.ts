/** Real VRM files, where they are at hand: their fingers and faces follow a performer. */
import { existsSync } from "node:fs";
import { type Object3D, Vector3 } from "three";
import { describe, expect, test } from "vitest";
import { Avatar } from "../../src/avatar/avatar";
import { restPose } from "../../src/motion/skeleton";
import { bendFinger, createHands, poseOfHands } from "../motion/hand-poses";
import { createStandardFigure } from "../stage/puppet/figures";
import { faceOf } from "./face/faces";
import { readVrmSample, VRM_FOLDER } from "./vrm-samples";

/** Expressions of the files that show a blink, an open mouth and a smile. */
const FILES: Readonly<Record<string, Readonly<Record<string, string>>>> = {
  "Godette_vrm_v4.vrm": { blink: "blinkLeft", aa: "aa", happy: "happy" },
  "cool_loops.vrm": { blink: "blink", aa: "aa" },
  "cryptovoxels.vrm": {},
};
const FACES = {
  blink: faceOf({ eyeBlinkLeft: 1, eyeBlinkRight: 1 }),
  aa: faceOf({ jawOpen: 1 }),
  happy: faceOf({ mouthSmileLeft: 1, mouthSmileRight: 1 }),
};

describe.runIf(existsSync(VRM_FOLDER)).each(Object.entries(FILES))("%s", (name, expressions) => {
  const load = async () => {
    const model = await readVrmSample(name);
    return { model, avatar: new Avatar(model, createStandardFigure()) };
  };

  test("bends its index fingers towards the palms", async () => {
    const { model, avatar } = await load();
    const place = (bone: string) =>
      new Vector3().setFromMatrixPosition((model.nodes.get(bone) as Object3D).matrixWorld);
    for (const side of ["left", "right"]) {
      const angles = [0, 0.5, 1].map((angle) => {
        avatar.apply({ ...restPose(), hands: poseOfHands(createHands(), (chain) => bendFinger(chain, angle)) }, 0);
        const finger = place(`${side}IndexIntermediate`).sub(place(`${side}IndexProximal`));
        const inwards = new Vector3(side === "left" ? -1 : 1, 0, 0);
        return Math.atan2(finger.dot(inwards), -finger.y);
      });
      angles.forEach((angle, at) => {
        expect(angle).toBeCloseTo(at / 2, 2);
      });
    }
  });

  test.runIf(Object.keys(expressions).length > 0)("shows a face with its presets", async () => {
    const { model, avatar } = await load();
    for (const [face, expression] of Object.entries(expressions)) {
      avatar.apply({ ...restPose(), face: FACES[face as keyof typeof FACES] }, 0);
      expect(model.vrm?.expressionManager?.getValue(expression)).toBeCloseTo(1, 6);
      avatar.apply({ ...restPose(), face: null }, 0);
      expect(model.vrm?.expressionManager?.getValue(expression)).toBe(0);
    }
  });
});
