import { expect, test, vi } from "vitest";
import { PerformerView } from "../../src/client/performer-view";
import type { LimbSolver } from "../../src/client/solver";
import { SolverLoader } from "../../src/client/solver-loader";
import { decodeMotionBlock } from "../../src/codec/motion-decoder";
import { MotionTrack } from "../../src/codec/motion-track";
import { restPose } from "../../src/motion/skeleton";
import { MotionBlockStore } from "../../src/playout/block-store";
import { OverlayBuffer } from "../../src/playout/overlay-buffer";
import { type BlockVectors, goldenDescription } from "../golden-motion";
import { decodeBase64, loadVectors } from "../golden-vectors";

const [block, , , last] = loadVectors<BlockVectors>("blocks").valid.map((vector) => decodeBase64(vector.block));
const track = MotionTrack.fromDescription({ ...goldenDescription(), front: 0.25, place: [2, -3, Math.PI / 2] });

/** Performer `number` of the golden motion in a place of its own, how often its solver was made, and its blocks. */
function performing(number: number) {
  const store = new MotionBlockStore(track),
    made = vi.fn(() => ({ limbs: [] }) as LimbSolver);
  return {
    store,
    made,
    performance: new PerformerView(number, store, new SolverLoader(track.figure, "http://stage", made)),
  };
}

test("faces where its dance does, and then as it is turned", () => {
  const { performance } = performing(0);
  expect(performance.front).toBe(0.25 + Math.PI / 2);
  expect([performance.figure, performance.placement]).toEqual([track.figure, { x: 2, z: -3, turn: Math.PI / 2 }]);
});

test("is seen once a block is here, in its place, and holds still where the next is missing", () => {
  const { store, performance } = performing(0);
  const overlays = new OverlayBuffer(),
    wanted = restPose();
  expect([performance.seek(0, true, 2_600_000), performance.pose(0, overlays, null, 0)]).toEqual([false, null]);
  store.put(0, 1, block);
  expect(performance.seek(500_000, true, 2_600_000)).toBe(true);
  decodeMotionBlock(track, block).poseAt(15, wanted);
  const pose = performance.pose(0, overlays, null, 0)!;
  // turned by a quarter from z towards x, and moved
  const [x, y, z] = wanted.root;
  [2 + z, y, -3 - x].forEach((value, i) => expect(pose.root[i]).toBeCloseTo(value, 12));
  expect(pose.rotations.subarray(4)).toEqual(wanted.rotations.subarray(4));
  const held = structuredClone(pose);
  expect(performance.seek(1_500_000, true, 2_600_000)).toBe(false);
  expect(performance.pose(0, overlays, null, 0)).toEqual(held);
  expect(performance.pose(0, overlays, null, 0)).toEqual(held);
});

test("of a dance that is shorter than the motion stands still at its end", () => {
  const { store, performance } = performing(0);
  store.put(0, 1, block);
  store.put(2, 1, last);
  performance.seek(2_600_000, false, 5_000_000);
  const still = structuredClone(performance.pose(0, new OverlayBuffer(), null, 0)!);
  performance.seek(4_999_999, true, 5_000_000);
  expect(performance.pose(0, new OverlayBuffer(), null, 0)).toEqual(still);
});

test("has laid over it what is pulled of its own limbs, and no other's", () => {
  const overlays = new OverlayBuffer();
  overlays.put({ name: "Overlay", sequence: 0, due: 1_000_000, limbs: new Map([[5, new Int16Array(9)]]), earlier: [] });
  const [alone, pulled] = [0, 1].map((number) => {
    const { store, performance } = performing(number);
    store.put(0, 1, block);
    performance.seek(500_000, true, 2_600_000);
    return performance.pose(1_000_000, overlays, null, 0)!;
  });
  // the right arm: shoulder, elbow and wrist at rest
  expect([...pulled.rotations.subarray(60, 72)]).toEqual([1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0]);
  expect(alone.rotations.subarray(0, 60)).toEqual(pulled.rotations.subarray(0, 60));
  expect(alone.rotations[60]).toBeLessThan(1);
});

test("what one's own limbs are solved with is made once it is seen", async () => {
  const { store, made, performance } = performing(1);
  performance.seek(0, true, 2_600_000);
  await Promise.resolve();
  expect(made).not.toHaveBeenCalled();
  store.put(0, 1, block);
  performance.seek(0, true, 2_600_000);
  performance.seek(1_000, true, 2_600_000);
  await vi.waitFor(() => expect(made).toHaveBeenCalledWith(track.figure, "http://stage"));
  performance.loadSolver();
  await Promise.resolve();
  expect(made).toHaveBeenCalledTimes(1);
});
