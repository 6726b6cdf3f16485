/** Exported files, uploaded again: what the server's reader makes of them. */
import { spawnSync } from "node:child_process";
import { join, resolve } from "node:path";
import { expect, test } from "vitest";
import { writeBvh } from "../../src/export/bvh";
import { writeGlb } from "../../src/export/glb";
import type { SampledMotion } from "../../src/export/sampled-motion";
import { writeVrma } from "../../src/export/vrma";
import { JOINTS } from "../../src/motion/skeleton";
import { createPuppetModel } from "../../src/stage/puppet/puppet-model";
import { extendedMotion, goldenMotion, joinParts, jointPositions, runToCompletion, turningMotion } from "./motions";

const REPOSITORY = resolve(import.meta.dirname, "../../../..");
/** Largest mean distance of the joints, in millimetres. */
const MAX_MEAN_MM = 0.5;

/** Humanoid bones begin at the hips: they have no root apart from the sacroiliac, which is where they differ. */
const LEFT_HIP = JOINTS.indexOf("l_hip");

/** Analyse a file, and return its joints relative to the left hip of the first frame. */
const PYTHON = `
import json, sys
from bunraku.motion.analysis import analyse
from bunraku.motion.extension import extend_pose
from bunraku.motion.readers.motion_file import read_motion
from bunraku.motion.skeleton import JOINTS, world_transforms
analysis = analyse(read_motion(sys.stdin.buffer.read()))
motion = analysis.motion
positions, orientations = world_transforms(motion.figure, motion.root, motion.rotations)
if analysis.extension is not None:
    found = analysis.extension
    positions = extend_pose(motion.figure, found.extension, positions, orientations, found.values).positions
result = {"fps": motion.fps, "profile": analysis.profile, "extension": analysis.extension is not None, "places": (positions - positions[0, JOINTS.index('l_hip')]).ravel().tolist()}
json.dump(result, sys.stdout)
`;

const FORMATS = {
  BVH: (motion: SampledMotion) => writeBvh(motion),
  GLB: (motion: SampledMotion) => writeGlb([{ motion, model: createPuppetModel(motion.figure) }], "dance", null),
  VRMA: (motion: SampledMotion) => writeVrma(motion, "dance"),
};
const MOTIONS = {
  turning: withStillPelvis(turningMotion()),
  golden: withStillPelvis(goldenMotion()),
  "extended (three joints of the spine)": extendedMotion(0),
  "extended (no joint of the spine)": extendedMotion(1),
  "extended (one joint of the spine)": extendedMotion(2),
};

/** Keep the sacroiliac in the frame of the root, from which the spine of a humanoid hangs in VRMA. */
function withStillPelvis(motion: SampledMotion): SampledMotion {
  const pelvis = JOINTS.indexOf("sacroiliac");
  for (let frame = 0; frame < motion.frames; frame++) motion.rotations.set([1, 0, 0, 0], (frame * 18 + pelvis) * 4);
  return motion;
}

for (const [format, write] of Object.entries(FORMATS)) {
  test.each(Object.entries(MOTIONS))(`a %s motion in ${format} is read as it was`, async (_, motion) => {
    const file = await joinParts(runToCompletion<Uint8Array<ArrayBuffer>[]>(write(motion)));
    const python = spawnSync(join(REPOSITORY, ".venv/bin/python"), ["-c", PYTHON], {
      input: new Uint8Array(file),
      cwd: REPOSITORY,
      maxBuffer: 1e8,
    });
    expect(python.stderr.toString()).toBe("");
    const result = JSON.parse(python.stdout.toString()) as {
      fps: number;
      profile: string;
      extension: boolean;
      places: number[];
    };
    expect(result.fps).toBeCloseTo(motion.fps, 3);
    expect(result.extension).toBe(Boolean(motion.extension));
    expect(result.places.length).toBe(motion.frames * 54);
    const [x, y, z] = jointPositions(motion, 0).subarray(3 * LEFT_HIP);
    let sum = 0;
    for (let frame = 0; frame < motion.frames; frame++) {
      const expected = jointPositions(motion, frame);
      for (let joint = 3 * LEFT_HIP; joint < 54; joint += 3) {
        const at = frame * 54 + joint;
        sum += Math.hypot(
          result.places[at] - expected[joint] + x,
          result.places[at + 1] - expected[joint + 1] + y,
          result.places[at + 2] - expected[joint + 2] + z,
        );
      }
    }
    expect((1000 * sum) / (motion.frames * (18 - LEFT_HIP))).toBeLessThan(MAX_MEAN_MM);
  });
}
