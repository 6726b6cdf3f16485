import { afterEach, beforeEach, expect, test, vi } from "vitest";
import type { RemotePlayback } from "../../src/app/remote-playback";
import { StageOverlay } from "../../src/app/stage-overlay";
import type { Page } from "../../src/ui/page";
import { type AnimationFrames, stubAnimationFrames } from "./animation-frames";

const FACE = { left: 10, top: 10, right: 30, bottom: 40 };

let frames: AnimationFrames;
let calls: unknown[][];
let playback: RemotePlayback | null;
let overlay: StageOverlay;

beforeEach(() => {
  frames = stubAnimationFrames();
  calls = [];
  const record =
    (name: string) =>
    (...args: unknown[]) =>
      void calls.push([name, ...args]);
  playback = { position: 1.5, duration: 20, sendLead: () => record("lead")() } as unknown as RemotePlayback;
  const canvas = { dataset: {}, toggleAttribute: record("attribute") } as unknown as HTMLCanvasElement;
  const page = {
    nameTags: { place: record("labels") },
    messageArea: { avoidFaces: record("faces") },
    transport: { setCamera: record("camera"), setPosition: record("position") },
  } as unknown as Page;
  overlay = new StageOverlay(canvas, page, () => playback);
});
afterEach(() => void vi.unstubAllGlobals());

const namesOf = () => calls.map(([name]) => name);

test("changes of several messages are shown together, at the next frame", () => {
  const labels = { tags: [], invitation: null };
  overlay.update({ labels, faces: [] });
  overlay.update({ faces: [FACE], isPulling: true });
  expect([calls, frames.pending]).toEqual([[], 1]);
  frames.run();
  expect(calls).toEqual([
    ["labels", labels],
    ["faces", [FACE]],
    ["attribute", "data-pulling", true],
    ["camera", false, false],
    ["position", 1.5, 20],
    ["lead"],
  ]);
});

test("without an update no frame is requested, and unchanged parts are not shown again", () => {
  overlay.update({ faces: [FACE], hasMotionCamera: true });
  frames.run();
  expect(frames.pending).toBe(0);
  calls.length = 0;
  overlay.update();
  frames.run();
  expect(namesOf()).toEqual(["camera", "position", "lead"]);
  expect(calls[0]).toEqual(["camera", true, false]);
});

test("the stage is shown before a session was entered", () => {
  playback = null;
  overlay.update({ faces: [FACE] });
  frames.run();
  expect(namesOf()).toEqual(["faces", "camera"]);
});
