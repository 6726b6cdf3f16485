import { spawnSync } from "node:child_process";
import { join, resolve } from "node:path";
import { BVHLoader } from "three/examples/jsm/loaders/BVHLoader.js";
import { expect, test } from "vitest";
import { writeBvh } from "../../src/export/bvh";
import type { SampledMotion } from "../../src/export/sampled-motion";
import { createOtherFigure } from "../stage/puppet/figures";
import { goldenMotion, joinParts, jointPositions, maxJointError, runToCompletion, turningMotion } from "./motions";

const BESIDE = { x: 1.3, z: -0.4, turn: 2.2 };
const REPOSITORY = resolve(import.meta.dirname, "../../../..");

async function written(dance: SampledMotion): Promise<string> {
  return new TextDecoder().decode(await joinParts(runToCompletion(writeBvh(dance))));
}

test.each([
  ["turning", turningMotion()],
  ["of another build", turningMotion({ figure: createOtherFigure() })],
  ["golden", goldenMotion()],
  ["of a second dancer in its place", goldenMotion(1, BESIDE)],
])("three.js reads a dance %s as it is", async (_, dance) => {
  const { skeleton, clip } = new BVHLoader().parse(await written(dance));
  expect(skeleton.bones[0].name).toBe("humanoid_root");
  expect(maxJointError(dance, skeleton.bones[0], clip, 0.01)).toBeLessThan(1e-4);
});

/** Reads BVH with our reader and says where all joints are, and writes the same motion with our writer. */
const PYTHON = `
import json, sys
import numpy as np
from bunraku.motion import bvh
from bunraku.motion.bvh_kinematics import pose
from bunraku.motion.placement import Place
from bunraku.motion.skeleton import JOINTS, Figure, Motion
from bunraku.motion.bvh_writer import write_bvh
asked = json.load(sys.stdin)
figure = Figure(np.array(asked["offsets"]).reshape(18, 3), np.array(asked["tips"]).reshape(18, 3))
frames = asked["frames"]
place = Place(**asked["place"])
motion = Motion(figure, asked["fps"], *place.bring(np.array(asked["roots"]).reshape(frames, 3), np.array(asked["rotations"]).reshape(frames, 18, 4)))
read = bvh.read(asked["text"].encode())
order = [read.names.index(name) for name in JOINTS]
position, _ = pose(read, order)
json.dump({"fps": read.fps, "places": position[:, order].ravel().tolist(), "text": write_bvh(motion).decode()}, sys.stdout)
`;

test.each([
  ["turning", turningMotion()],
  ["golden", goldenMotion()],
  ["of a second dancer in its place", turningMotion({ place: BESIDE })],
])("our own reader reads a dance %s as it is, and our Python writer writes it alike", async (_, dance) => {
  const text = await written(dance);
  const { figure, fps, frames, roots, rotations } = dance;
  const asked = {
    text,
    fps,
    frames,
    offsets: [...figure.offsets],
    tips: [...figure.tips],
    roots: [...roots],
    rotations: [...rotations],
    place: dance.placement,
  };
  const python = spawnSync(join(REPOSITORY, ".venv/bin/python"), ["-c", PYTHON], {
    input: JSON.stringify(asked),
    encoding: "utf8",
    cwd: REPOSITORY,
    maxBuffer: 1e8,
  });
  expect(python.stderr).toBe("");
  const said = JSON.parse(python.stdout) as { fps: number; places: number[]; text: string };
  expect(said.fps).toBeCloseTo(fps, 6);
  for (let frame = 0; frame < frames; frame++) {
    jointPositions(dance, frame).forEach((value, i) =>
      expect(Math.abs(said.places[frame * 54 + i] * 0.01 - value)).toBeLessThan(1e-6),
    );
  }
  const words = (of: string) => of.split(/[ \n]/);
  const [ours, theirs] = [words(text), words(said.text)];
  expect(ours.length).toBe(theirs.length);
  // the last of six decimals may be rounded the other way
  ours.forEach(
    (word, i) => word === theirs[i] || expect(Math.abs(Number(word) - Number(theirs[i]))).toBeLessThan(1.5e-6),
  );
});

test("a joint that is turned a quarter about x, where two angles are one, is read as it is", async () => {
  const dance = turningMotion();
  for (let frame = 0; frame < dance.frames; frame++)
    dance.rotations.set([Math.SQRT1_2, Math.SQRT1_2, 0, 0], (frame * 18 + 12) * 4);
  const { skeleton, clip } = new BVHLoader().parse(await written(dance));
  expect(maxJointError(dance, skeleton.bones[0], clip, 0.01)).toBeLessThan(1e-4);
});
