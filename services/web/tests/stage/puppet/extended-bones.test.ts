import { Texture, Vector3 } from "three";
import { expect, test } from "vitest";
import { createExtendedPose, extendPose, type StagedPose } from "../../../src/motion/extension";
import { createWorldTransforms, type Figure, JOINTS, worldTransforms } from "../../../src/motion/skeleton";
import { TRUNK_BONES } from "../../../src/stage/puppet/bones";
import { Puppet, setPuppetExtension } from "../../../src/stage/puppet/puppet";
import { PuppetAssets } from "../../../src/stage/puppet/puppet-assets";
import { PuppetExtension } from "../../../src/stage/puppet/puppet-extension";
import { extensionVectors, goldenBody } from "../../golden-extensions";

setPuppetExtension(PuppetExtension);
const golden = extensionVectors();
const assets = new PuppetAssets({ face: new Texture(), asanoha: new Texture() }, { value: 0 });

function puppetOf(vector: (typeof golden.poses)[number]): { puppet: Puppet; pose: StagedPose; extended: StagedPose } {
  const figure: Figure = { offsets: Float64Array.from(vector.offsets), tips: new Float64Array(54) };
  const pose = { root: Float64Array.from(vector.root), rotations: Float64Array.from(vector.rotations) };
  const extension = goldenBody(golden.tracks[vector.track]);
  const world = worldTransforms(figure, pose, createWorldTransforms());
  const extended = extendPose(figure, world, Float64Array.from(vector.values), createExtendedPose(extension));
  return { puppet: new Puppet(figure, assets), pose, extended: { ...pose, extended } };
}

/** Return the drawn position of a bone. */
function drawnAt(puppet: Puppet, name: string): Vector3 {
  const bone = puppet.group.getObjectByName(name);
  return new Vector3().setFromMatrixPosition(bone?.matrixWorld as Puppet["root"]);
}

test.each(golden.poses)("limbs of track $track are drawn at the extended joints", (vector) => {
  const { puppet, extended } = puppetOf(vector);
  puppet.apply(extended, 0);
  for (const name of JOINTS.filter((joint) => joint !== "vl5")) {
    const at = JOINTS.indexOf(name) * 3;
    expect(drawnAt(puppet, name).distanceTo(new Vector3(...vector.positions.slice(at, at + 3)))).toBeLessThan(1e-6);
  }
});

test("joints of the stream and handles stay those of the figure and the drawn hand", () => {
  const { puppet, pose, extended } = puppetOf(golden.poses[1]);
  puppet.apply(pose, 0);
  const chest = puppet.joint("vl5").clone();
  const shoulder = puppet.joint("l_shoulder").clone();
  puppet.apply(extended, 0);
  expect(puppet.joint("vl5").elements).toEqual(chest.elements.map((value) => expect.closeTo(value, 9)));
  expect(puppet.joint("l_shoulder").elements).toEqual(shoulder.elements.map((value) => expect.closeTo(value, 9)));
  expect(drawnAt(puppet, "l_shoulder").distanceTo(new Vector3().setFromMatrixPosition(shoulder))).toBeGreaterThan(
    0.005,
  );
  // A hand that is to stay where it is drawn keeps the streamed handle where it is.
  const handle = puppet.handle(0, new Vector3());
  const streamed = puppet.toStreamedHandle(0, handle, new Vector3());
  const moved = puppet.toStreamedHandle(0, handle.clone().add(new Vector3(0.1, 0, 0)), new Vector3());
  expect(moved.sub(streamed).distanceTo(new Vector3(0.1, 0, 0))).toBeLessThan(1e-9);
});

test("without an extension the puppet returns to its own lengths", () => {
  const { puppet, pose, extended } = puppetOf(golden.poses[1]);
  puppet.apply(pose, 0);
  const before = [...JOINTS, ...TRUNK_BONES].map((name) => drawnAt(puppet, name));
  puppet.apply(extended, 0);
  puppet.apply(pose, 0);
  [...JOINTS, ...TRUNK_BONES].forEach((name, k) =>
    expect(drawnAt(puppet, name).distanceTo(before[k])).toBeLessThan(1e-9),
  );
});

test("the trunk's bones turn with the joints of the extension", () => {
  const { puppet, extended } = puppetOf(golden.poses[1]);
  puppet.apply(extended, 0);
  const vl5 = puppet.group.getObjectByName("vl5")?.matrixWorld;
  const chest = puppet.group.getObjectByName("chest")?.matrixWorld;
  const up = (matrix: typeof vl5) => new Vector3(0, 1, 0).transformDirection(matrix as Puppet["root"]);
  expect(up(vl5).angleTo(up(chest))).toBeGreaterThan(0.05);
});
