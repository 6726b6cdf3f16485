import { describe, expect, test } from "vitest";
import { ControlledHand, ControlledLeg, type ControlledLimb } from "../../src/marionette/controlled-limb";
import { Handover } from "../../src/marionette/handover";
import { fromRotationVector } from "../../src/motion/rotation";
import { loadVectors } from "../golden-vectors";
import { figure, table } from "./figure";

interface Case {
  limb: 0 | 1 | 2 | 3;
  swing: number[][];
  hertz: number[][];
  phase: number[][];
  asked: [number, number[] | null][];
  every: number;
  joints: (number[][] | null)[];
}

const vector = loadVectors<{ seconds: number; frames: number; cases: Case[] }>("pulled");

function makeLimb(limb: 0 | 1 | 2 | 3): ControlledLimb {
  return limb === 0 || limb === 1 ? new ControlledHand(figure, limb, table) : new ControlledLeg(figure, limb);
}

/** Return the pose of the motion of a case at a frame. */
function pose({ swing, hertz, phase }: Case, frame: number): Float64Array {
  const rotations = new Float64Array(72),
    t = frame * vector.seconds;
  for (let joint = 0; joint < 18; joint++) {
    const [x, y, z] = [0, 1, 2].map(
      (i) => swing[joint][i] * Math.sin(2 * Math.PI * hertz[joint][i] * t + phase[joint][i]),
    );
    fromRotationVector(rotations, 4 * joint, x, y, z);
  }
  return rotations;
}

describe("a limb that is claimed, controlled and released", () => {
  test.each(vector.cases)("limb $limb equals the golden vectors", (vectorCase) => {
    const controlled = makeLimb(vectorCase.limb),
      handover = new Handover(),
      joints = new Float64Array(12);
    const { seconds, frames } = vector;
    let target: Float64Array | null = null,
      isControlled = false,
      compared = 0;
    for (let frame = 0; frame < frames; frame++) {
      for (const [begin, requested] of vectorCase.asked) {
        if (begin !== frame) continue;
        target = requested && Float64Array.from(requested);
        isControlled ||= requested !== null;
      }
      const rotations = pose(vectorCase, frame);
      handover.advance(target !== null, seconds);
      controlled.observePose(rotations, seconds);
      const out = isControlled && controlled.solveJoints(joints, 0, rotations, target, handover.weight, seconds);
      if (isControlled && !out) {
        controlled.reset();
        isControlled = false;
      }
      if (frame % vectorCase.every !== 0) continue;
      const golden = vectorCase.joints[frame / vectorCase.every];
      expect(out, `frame ${frame}`).toBe(golden !== null);
      golden?.forEach((q, joint) => {
        const dot = q.reduce((sum, value, i) => sum + value * joints[4 * joint + i], 0);
        q.forEach((value, i) => {
          expect(
            Math.abs(joints[4 * joint + i] * Math.sign(dot) - value),
            `frame ${frame}, joint ${joint}`,
          ).toBeLessThan(1e-9);
        });
        compared++;
      });
    }
    expect(compared).toBeGreaterThan(90);
  });
});
