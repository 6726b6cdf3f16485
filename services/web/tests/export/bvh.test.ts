import { spawnSync } from "node:child_process";
import { join, resolve } from "node:path";
import { BVHLoader } from "three/examples/jsm/loaders/BVHLoader.js";
import { expect, test } from "vitest";
import { writeBvh } from "../../src/export/bvh";
import type { SampledMotion } from "../../src/export/sampled-motion";
import { createOtherFigure } from "../stage/puppet/figures";
import {
  extendedMotion,
  goldenMotion,
  joinParts,
  jointPositions,
  maxJointError,
  runToCompletion,
  turningMotion,
  withHands,
} from "./motions";

const BESIDE = { x: 1.3, z: -0.4, turn: 2.2 };
const REPOSITORY = resolve(import.meta.dirname, "../../../..");

async function writtenText(motion: SampledMotion): Promise<string> {
  return new TextDecoder().decode(await joinParts(runToCompletion(writeBvh(motion))));
}

test.each([
  ["turning", turningMotion()],
  ["differently proportioned", turningMotion({ figure: createOtherFigure() })],
  ["golden", goldenMotion()],
  ["placed", goldenMotion(1, BESIDE)],
  ["handed", withHands(goldenMotion(1, BESIDE))],
  ["partly handed", withHands(turningMotion(), [2, 1, 0, 3, 0, 0, 0, 0, 0, 0])],
  ["handed, extended", withHands({ ...extendedMotion(0), placement: BESIDE })],
])("three.js reads a %s motion unchanged", async (_, motion) => {
  const { skeleton, clip } = new BVHLoader().parse(await writtenText(motion));
  expect(skeleton.bones[0].name).toBe("humanoid_root");
  expect(maxJointError(motion, skeleton.bones[0], clip, 0.01)).toBeLessThan(1e-4);
});

test("fingers end in sites, a wrist only without fingers", async () => {
  const motion = withHands(turningMotion(), [3, 3, 3, 3, 3, 0, 0, 0, 0, 0]);
  const { bones } = new BVHLoader().parse(await writtenText(motion)).skeleton;
  const endOf = (name: string) => bones.find((bone) => bone.name === name)?.children.map((child) => child.name);
  expect(endOf("r_wrist")).toEqual(["ENDSITE"]);
  expect(endOf("l_carpal_distal_interphalangeal_2")).toEqual(["ENDSITE"]);
  expect(endOf("l_wrist")).toEqual([
    "l_carpometacarpal_1",
    ...[2, 3, 4, 5].map((digit) => `l_metacarpophalangeal_${digit}`),
  ]);
});

/** Parse BVH with the Python reader, and write the same motion with the Python writer. */
const PYTHON = `
import json, sys
import numpy as np
from bunraku.motion.readers.bvh import parse_bvh
from bunraku.motion.placement import Placement
from bunraku.motion.skeleton import JOINTS, Figure, Motion
from bunraku.motion.bvh_writer import write_bvh
request = json.load(sys.stdin)
figure = Figure(np.array(request["offsets"]).reshape(18, 3), np.array(request["tips"]).reshape(18, 3))
frames = request["frames"]
placement = Placement(**request["place"])
roots = np.array(request["roots"]).reshape(frames, 3)
rotations = np.array(request["rotations"]).reshape(frames, 18, 4)
motion = Motion(figure, request["fps"], *placement.apply(roots, rotations))
parsed = parse_bvh(request["text"].encode())
order = [parsed.names.index(name) for name in JOINTS]
positions, _ = parsed.world_transforms(order)
result = {"fps": parsed.fps, "places": positions[:, order].ravel().tolist(), "text": write_bvh(motion).decode()}
json.dump(result, sys.stdout)
`;

test.each([
  ["turning", turningMotion()],
  ["golden", goldenMotion()],
  ["placed", turningMotion({ place: BESIDE })],
])("the Python reader reads a %s motion, and the Python writer agrees", async (_, motion) => {
  const text = await writtenText(motion);
  const { figure, fps, frames, roots, rotations } = motion;
  const request = {
    text,
    fps,
    frames,
    offsets: [...figure.offsets],
    tips: [...figure.tips],
    roots: [...roots],
    rotations: [...rotations],
    place: motion.placement,
  };
  const python = spawnSync(join(REPOSITORY, ".venv/bin/python"), ["-c", PYTHON], {
    input: JSON.stringify(request),
    encoding: "utf8",
    cwd: REPOSITORY,
    maxBuffer: 1e8,
  });
  expect(python.stderr).toBe("");
  const result = JSON.parse(python.stdout) as { fps: number; places: number[]; text: string };
  expect(result.fps).toBeCloseTo(fps, 6);
  for (let frame = 0; frame < frames; frame++) {
    jointPositions(motion, frame).forEach((value, i) =>
      expect(Math.abs(result.places[frame * 54 + i] * 0.01 - value)).toBeLessThan(1e-6),
    );
  }
  const words = (content: string) => content.split(/[ \n]/);
  const [ours, theirs] = [words(text), words(result.text)];
  expect(ours.length).toBe(theirs.length);
  // The last of six decimals may be rounded differently.
  ours.forEach(
    (word, i) => word === theirs[i] || expect(Math.abs(Number(word) - Number(theirs[i]))).toBeLessThan(1.5e-6),
  );
});

test("a joint in gimbal lock is read correctly", async () => {
  const motion = turningMotion();
  for (let frame = 0; frame < motion.frames; frame++)
    motion.rotations.set([Math.SQRT1_2, Math.SQRT1_2, 0, 0], (frame * 18 + 12) * 4);
  const { skeleton, clip } = new BVHLoader().parse(await writtenText(motion));
  expect(maxJointError(motion, skeleton.bones[0], clip, 0.01)).toBeLessThan(1e-4);
});
