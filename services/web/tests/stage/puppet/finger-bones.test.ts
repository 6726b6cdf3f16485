import fc from "fast-check";
import { type Bone, type Matrix4, Texture, Vector3 } from "three";
import { expect, test, vi } from "vitest";
import type { StagedPose } from "../../../src/motion/extension";
import { chainJoints, type Hands, poseHands } from "../../../src/motion/hands";
import { createWorldTransforms, type Figure, restPose, worldTransforms } from "../../../src/motion/skeleton";
import { fitFingers } from "../../../src/stage/puppet/figure-fit";
import { FINGER_BONES } from "../../../src/stage/puppet/hand/finger-joints";
import { Puppet } from "../../../src/stage/puppet/puppet";
import { PuppetAssets } from "../../../src/stage/puppet/puppet-assets";
import { jointPosition } from "../../../src/stage/puppet/standard-figure";
import { createOtherFigure, createStandardFigure } from "./figures";

const assets = new PuppetAssets({ face: new Texture(), asanoha: new Texture() }, { value: 0 });

function createHands(counts: readonly number[]): Hands {
  return { counts, bases: new Float64Array(30), lengths: new Float64Array(30) };
}

function createPose(counts: readonly number[], values?: Float64Array): StagedPose {
  const hands = createHands(counts);
  return {
    ...restPose(),
    hands: { hands, values: values ?? new Float64Array(chainJoints(hands).length * 3) },
  };
}

/** Create a puppet whose finger bones are loaded. */
async function createPuppet(figure: Figure = createStandardFigure()): Promise<Puppet> {
  const puppet = new Puppet(figure, assets);
  puppet.apply(createPose(new Array(10).fill(3)), 0);
  await vi.waitFor(() => {
    puppet.apply(createPose(new Array(10).fill(3)), 0);
    expect(matrixOf(puppet, "l_index_1").equals(restMatrix(figure, "l_index_1"))).toBe(false);
  });
  puppet.apply(restPose(), 0);
  return puppet;
}

function matrixOf(puppet: Puppet, name: string): Matrix4 {
  const bone = puppet.group.getObjectByName(name) as Bone;
  return bone.matrixWorld.clone();
}

function restMatrix(figure: Figure, name: string): Matrix4 {
  const puppet = new Puppet(figure, assets);
  puppet.apply(restPose(), 0);
  return matrixOf(puppet, name);
}

/** Return the drawn direction of the segment after a joint. */
function directionOf(puppet: Puppet, figure: Figure, index: number): Vector3 {
  const joints = fitFingers(figure)[Math.floor(index / 3)];
  const place = index % 3;
  return joints[place + 1].clone().sub(joints[place]).transformDirection(matrixOf(puppet, FINGER_BONES[index]));
}

test("segments have the directions of the performer's fingers, and the puppet's lengths", async () => {
  const figure = createOtherFigure();
  const puppet = await createPuppet(figure);
  await fc.assert(
    fc.asyncProperty(
      fc.array(fc.double({ min: -1.5, max: 1.5, noNaN: true }), { minLength: 90, maxLength: 90 }),
      async (list) => {
        const pose = createPose(new Array(10).fill(3), Float64Array.from(list));
        puppet.apply(pose, 0);
        const world = worldTransforms(figure, pose, createWorldTransforms());
        const out = { positions: new Float64Array(90), orientations: new Float64Array(120) };
        poseHands(pose.hands as NonNullable<StagedPose["hands"]>, world, out);
        chainJoints(createHands(new Array(10).fill(3))).forEach(([chain], index) => {
          const [w, x, y, z] = out.orientations.subarray(index * 4, index * 4 + 4);
          const straight = chain % 5 === 0 ? new Vector3(0, -1, 1).normalize() : new Vector3(0, -1, 0);
          const expected = straight.applyQuaternion({ x, y, z, w } as never);
          expect(directionOf(puppet, figure, index).distanceTo(expected)).toBeLessThan(1e-6);
        });
        const [first, second] = ["l_middle_1", "l_middle_2"].map((name) =>
          new Vector3().setFromMatrixPosition(matrixOf(puppet, name)),
        );
        const joints = fitFingers(figure)[2];
        expect(first.distanceTo(second)).toBeCloseTo(joints[0].distanceTo(joints[1]), 9);
      },
    ),
    { numRuns: 30 },
  );
});

test("fingers that the performer lacks, and all without data, are at rest", async () => {
  const figure = createStandardFigure();
  const puppet = await createPuppet(figure);
  const rest = FINGER_BONES.map((name) => restMatrix(figure, name).elements);
  const close = (elements: readonly number[]) => elements.map((value) => expect.closeTo(value, 9));
  const counts = [0, 3, 0, 0, 0, 0, 0, 0, 0, 0];
  puppet.apply(createPose(counts, Float64Array.from([0, 0, -1, 0, 0, -1, 0, 0, -1])), 0);
  FINGER_BONES.forEach((name, index) => {
    if (name.startsWith("l_index")) expect(matrixOf(puppet, name).elements).not.toEqual(close(rest[index]));
    else expect(matrixOf(puppet, name).elements).toEqual(close(rest[index]));
  });
  puppet.apply(restPose(), 0);
  FINGER_BONES.forEach((name, index) => expect(matrixOf(puppet, name).elements).toEqual(close(rest[index])));
});

test("outer joints that the performer lacks bend with those before, within bounds", async () => {
  const figure = createStandardFigure();
  const puppet = await createPuppet(figure);
  const index = FINGER_BONES.indexOf("l_index_1");
  const bendOf = (bend: number) => {
    puppet.apply(createPose([0, 1, 0, 0, 0, 0, 0, 0, 0, 0], Float64Array.from([0.2, 0, -bend])), 0);
    return [0, 1].map((place) =>
      directionOf(puppet, figure, index + place).angleTo(directionOf(puppet, figure, index + place + 1)),
    );
  };
  expect(Math.max(...bendOf(0))).toBeLessThan(1e-6);
  expect(Math.max(...bendOf(-0.5))).toBeLessThan(1e-6);
  expect(bendOf(1)[0]).toBeCloseTo(0.9, 6);
  expect(bendOf(1)[1]).toBeCloseTo(0.585, 6);
  expect(Math.max(...bendOf(3))).toBeLessThan(1.71);
});

test("fingers of the mesh are fitted to the figure with the palm", () => {
  const figure = createStandardFigure(1.2);
  const [thumb] = fitFingers(figure);
  const scaled = jointPosition("l_wrist").multiplyScalar(1.2);
  expect(thumb[0].distanceTo(scaled)).toBeCloseTo(
    1.2 * fitFingers(createStandardFigure())[0][0].distanceTo(jointPosition("l_wrist")),
    9,
  );
});
