import { expect, test, vi } from "vitest";
import type { LimbSolver } from "../../src/client/marionette-solver";
import { type FrameContext, PerformerView, type StagedFrame } from "../../src/client/performer-view";
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

/** Return the context of a frame without a predictor. */
function frame(clock: number, overlays = new OverlayBuffer()): FrameContext {
  return { clock, nowMs: 0, overlays, predictor: null, partner: () => null };
}

/** Create performer `number` of the golden motion at another placement. */
function createView(number: number) {
  const store = new MotionBlockStore(track),
    createSolver = vi.fn(() => ({ limbs: [] }) as LimbSolver);
  return {
    store,
    createSolver,
    view: new PerformerView(number, store, new SolverLoader(track.figure, "http://stage", createSolver)),
  };
}

test("facing is that of the motion, turned by the placement", () => {
  const { view } = createView(0);
  expect(view.front).toBe(0.25 + Math.PI / 2);
  expect([view.figure, view.placement]).toEqual([track.figure, { x: 2, z: -3, turn: Math.PI / 2 }]);
});

test("pose is placed, and kept while the next block is missing", () => {
  const { store, view } = createView(0);
  const overlays = new OverlayBuffer(),
    expected = restPose();
  expect([view.seek(0, true, 2_600_000), view.pose(frame(0, overlays))]).toEqual([false, null]);
  store.put(0, 1, block);
  expect(view.seek(500_000, true, 2_600_000)).toBe(true);
  decodeMotionBlock(track, block).poseAt(15, expected);
  const pose = view.pose(frame(0, overlays))!;
  // turned by 90 degrees from z towards x, and moved
  const [x, y, z] = expected.root;
  [2 + z, y, -3 - x].forEach((value, i) => expect(pose.root[i]).toBeCloseTo(value, 12));
  expect(pose.rotations.subarray(4)).toEqual(expected.rotations.subarray(4));
  const last = structuredClone(pose);
  expect(view.seek(1_500_000, true, 2_600_000)).toBe(false);
  expect(view.pose(frame(0, overlays))).toEqual(last);
  expect(view.pose(frame(0, overlays))).toEqual(last);
});

test("shorter track stands still at its end", () => {
  const { store, view } = createView(0);
  store.put(0, 1, block);
  store.put(2, 1, last);
  view.seek(2_600_000, false, 5_000_000);
  const still = structuredClone(view.pose(frame(0))!);
  view.seek(4_999_999, true, 5_000_000);
  expect(view.pose(frame(0))).toEqual(still);
});

test("overlay replaces the limbs of one performer only", () => {
  const overlays = new OverlayBuffer();
  overlays.put({ name: "Overlay", sequence: 0, due: 1_000_000, limbs: new Map([[5, new Int16Array(9)]]), earlier: [] });
  const [other, overlaid] = [0, 1].map((number) => {
    const { store, view } = createView(number);
    store.put(0, 1, block);
    view.seek(500_000, true, 2_600_000);
    return view.pose(frame(1_000_000, overlays))!;
  });
  // the right arm: shoulder, elbow and wrist at rest
  expect([...overlaid.rotations.subarray(60, 72)]).toEqual([1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0]);
  expect(other.rotations.subarray(0, 60)).toEqual(overlaid.rotations.subarray(0, 60));
  expect(other.rotations[60]).toBeLessThan(1);
});

test("solver is created once, at the first pose", async () => {
  const { store, createSolver, view } = createView(1);
  view.seek(0, true, 2_600_000);
  await Promise.resolve();
  expect(createSolver).not.toHaveBeenCalled();
  store.put(0, 1, block);
  view.seek(0, true, 2_600_000);
  view.seek(1_000, true, 2_600_000);
  await vi.waitFor(() => expect(createSolver).toHaveBeenCalledWith(track.figure, "http://stage"));
  view.loadSolver();
  await Promise.resolve();
  expect(createSolver).toHaveBeenCalledTimes(1);
});

test("frame for another performer's prediction leaves the drawn pose as it is", async () => {
  const { store, view } = createView(1);
  const context = frame(0);
  expect(view.partnerFrame(context)).toBeNull();
  store.put(0, 1, block);
  view.seek(500_000, true, 2_600_000);
  // the solver is created asynchronously
  await vi.waitFor(() => expect(view.partnerFrame(context)).not.toBeNull());
  const drawn = view.pose(context)!,
    before = structuredClone(drawn);
  view.seek(750_000, true, 2_600_000);
  const partner = view.partnerFrame(context)!;
  expect(drawn).toEqual(before);
  expect([partner.performer, partner.placement]).toEqual([1, view.placement]);
  // the predicted pose is that of the motion, not placed
  expect(partner.pose.root).toEqual(partner.motion.root);
  expect(partner.pose.root).not.toEqual(before.root);
  expect(partner.partner(0)).toBeNull();
});

test("predictor gets the frames of the other performers at the same instant", async () => {
  const [first, second] = [createView(0), createView(1)];
  for (const { store, view } of [first, second]) {
    store.put(0, 1, block);
    view.seek(500_000, true, 2_600_000);
  }
  const applyOwnLimbs = vi.fn(() => 0b10);
  const context = { ...frame(0), predictor: { applyOwnLimbs }, partner: () => second.view };
  await vi.waitFor(() => {
    first.view.pose(context);
    expect(applyOwnLimbs).toHaveBeenCalled();
  });
  const [[own]] = applyOwnLimbs.mock.calls as unknown as [[StagedFrame]];
  expect([own.performer, own.partner(1)?.performer, first.view.controlledLimbs]).toEqual([0, 1, 0b10]);
});
