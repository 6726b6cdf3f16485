/** Exported files, uploaded again: what the server's reader makes of them. */
import { spawnSync } from "node:child_process";
import { join, resolve } from "node:path";
import { expect, test } from "vitest";
import { writeBvh } from "../../src/export/bvh";
import { writeGlb } from "../../src/export/glb";
import {
  faceWeightsAt,
  type IncrementalTask,
  type SampledFace,
  type SampledMotion,
} from "../../src/export/sampled-motion";
import { writeVrma } from "../../src/export/vrma";
import { EXPRESSIONS, expressionIndex, faceExpressionNames } from "../../src/motion/face";
import { HANIM_NAMES, VRM_NAMES } from "../../src/motion/hands";
import { JOINTS } from "../../src/motion/skeleton";
import { createPuppetModel } from "../../src/stage/puppet/puppet-model";
import {
  extendedMotion,
  fingerPositions,
  goldenMotion,
  joinParts,
  jointPositions,
  runToCompletion,
  turningMotion,
  withFace,
  withHands,
} from "./motions";

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
  handed: withFace(withHands(withStillPelvis(goldenMotion())), "jawOpen", "happy", "gazeYaw"),
  "handed, extended": withHands(extendedMotion(0)),
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

/** Analyse a file, and return the weights of its face by expression. */
const PYTHON_FACE = `
import json, sys
from bunraku.motion.analysis import analyse
from bunraku.motion.face import EXPRESSIONS, face_expressions
from bunraku.motion.readers.motion_file import read_motion
face = analyse(read_motion(sys.stdin.buffer.read())).face
weights = face_expressions(face.face, face.values).T.tolist() if face else []
known = face.face.names if face else ()
json.dump({name: row for name, row in zip(EXPRESSIONS, weights) if name in known}, sys.stdout)
`;
/** Largest error of a weight, and of a gaze in radians. */
const MAX_WEIGHT_ERROR = 0.005;

async function readFace(work: IncrementalTask<Uint8Array<ArrayBuffer>[]>): Promise<Record<string, number[]>> {
  const python = spawnSync(join(REPOSITORY, ".venv/bin/python"), ["-c", PYTHON_FACE], {
    input: new Uint8Array(await joinParts(runToCompletion(work))),
    cwd: REPOSITORY,
    maxBuffer: 1e8,
  });
  expect(python.stderr.toString()).toBe("");
  return JSON.parse(python.stdout.toString()) as Record<string, number[]>;
}

function expectFace(found: Record<string, number[]>, motion: SampledMotion): void {
  expect(Object.keys(found)).toEqual(faceExpressionNames((motion.face as SampledFace).face));
  for (const [name, weights] of Object.entries(found))
    for (let frame = 0; frame < motion.frames; frame++) {
      const expected = (faceWeightsAt(motion, frame) as Float64Array)[expressionIndex(name)];
      expect(Math.abs(weights[frame] - expected)).toBeLessThan(MAX_WEIGHT_ERROR);
    }
}

/** Expressions of which no two exclude each other, so that a face keeps the weights of all. */
const COMPATIBLE = EXPRESSIONS.filter(
  (name) => !/^(jaw|mouth|look)Right$|^lookDown$|^eyeLook(InLeft|OutRight|Down)/.test(name),
);
/** Ways in which a VRM animation gives the gaze otherwise. */
const NO_GAZE = COMPATIBLE.filter((name) => !/^(gaze|look|eyeLook)/.test(name));

test.each([
  ["all expressions", "GLB", COMPATIBLE],
  ["four expressions, as many as numbers in a rotation", "GLB", ["jawOpen", "aa", "happy", "tongueOut"]],
  ["a gaze to the right and down", "GLB", ["gazeYaw", "gazePitch"]],
  ["all expressions but the gaze", "VRMA", NO_GAZE],
  ["a gaze to the right and down", "VRMA", ["gazeYaw", "gazePitch"]],
] as const)("%s in %s are read as they were", async (_, format, names) => {
  const motion = withFace(goldenMotion(), ...names);
  const { weights } = motion.face as SampledFace;
  for (let at = EXPRESSIONS.indexOf("gazeYaw"); at < weights.length; at += EXPRESSIONS.length)
    for (const axis of [0, 1]) weights[at + axis] *= -1.2;
  expectFace(await readFace(FORMATS[format](motion)), motion);
});

test("a file of several performers has the face of the first", async () => {
  const first = goldenMotion(1, { x: -1, z: 0, turn: 0 });
  const second = withFace(goldenMotion(0, { x: 1, z: 0.5, turn: 2 }), "jawOpen", "cheekPuff");
  const write = (motions: SampledMotion[]) =>
    writeGlb(
      motions.map((motion) => ({ motion, model: createPuppetModel(motion.figure) })),
      "duet",
      null,
    );
  const faced = withFace(first, "happy", "eyeBlinkLeft");
  expectFace(await readFace(write([faced, second])), faced);
  expect(await readFace(write([first, second]))).toEqual({});
});

/** Read a file, and return the joints of its fingers relative to the wrists, in metres. */
const PYTHON_FINGERS = `
import json, sys
from bunraku.motion.readers.motion_file import read_motion
names, data = json.loads(sys.stdin.buffer.readline()), sys.stdin.buffer.read()
source = read_motion(data)
order = [source.names.index(name) for name in names]
positions, _ = source.world_transforms(order)
scale = getattr(source, "metres_per_unit", None) or 0.01
places = {name: (positions[:, joint] - positions[:, order[0 if name.startswith("l") else 1]]) * scale for name, joint in zip(names, order)}
json.dump({name: place.ravel().tolist() for name, place in places.items()}, sys.stdout)
`;

test.each(Object.entries(FORMATS))("fingers in %s are read where they were", async (format, write) => {
  const motion = withHands(extendedMotion(0), [3, 3, 3, 3, 3, 2, 1, 0, 3, 0]);
  const file = new Uint8Array(await joinParts(runToCompletion<Uint8Array<ArrayBuffer>[]>(write(motion))));
  const isVrma = format === "VRMA";
  const wrists = isVrma ? ["leftHand", "rightHand"] : ["l_wrist", "r_wrist"];
  const ours = [...fingerPositions(motion, 0).keys()];
  const nameOf = (name: string) => (isVrma ? VRM_NAMES.flat()[HANIM_NAMES.flat().indexOf(name)] : name);
  const request = new TextEncoder().encode(`${JSON.stringify([...wrists, ...ours.map(nameOf)])}\n`);
  const python = spawnSync(join(REPOSITORY, ".venv/bin/python"), ["-c", PYTHON_FINGERS], {
    input: Buffer.concat([request, file]),
    cwd: REPOSITORY,
    maxBuffer: 1e8,
  });
  expect(python.stderr.toString()).toBe("");
  const places = JSON.parse(python.stdout.toString()) as Record<string, number[]>;
  for (let frame = 0; frame < motion.frames; frame++) {
    const joints = jointPositions(motion, frame);
    for (const [name, place] of fingerPositions(motion, frame)) {
      const wrist = 3 * JOINTS.indexOf(name.startsWith("l") ? "l_wrist" : "r_wrist");
      const [x, y, z] = places[nameOf(name)].slice(frame * 3);
      const [dx, dy, dz] = [0, 1, 2].map((axis) => joints[wrist + axis]);
      expect(1000 * Math.hypot(place.x - dx - x, place.y - dy - y, place.z - dz - z)).toBeLessThan(MAX_MEAN_MM);
    }
  }
});
