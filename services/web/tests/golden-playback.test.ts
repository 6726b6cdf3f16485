import { expect, test } from "vitest";
import { applyPlacement } from "../src/motion/placement";
import { restPose } from "../src/motion/skeleton";
import type { MotionBlockStore } from "../src/playout/block-store";
import { positionAt } from "../src/playout/timeline";
import { TrackSet } from "../src/playout/track-set";
import { unpack } from "../src/wire/codec";
import type { Data, Description, TimelineState } from "../src/wire/messages";
import { decodeBase64, loadVectors } from "./golden-vectors";

interface PlaybackVectors {
  description: string;
  data: string[];
  shows: {
    timeline: string;
    poses: { clock: number; position: number; performers: { root: number[]; rotations: number[] }[] }[];
  }[];
}

const golden = loadVectors<PlaybackVectors>("playback");
const tracks = new TrackSet((unpack(decodeBase64(golden.description)) as Description).tracks);
for (const bytes of golden.data) {
  const { track, index, rate, block } = unpack(decodeBase64(bytes)) as Data;
  (tracks.store(track) as MotionBlockStore).put(index, rate, block);
}

test.each(golden.shows)("a stream of messages gives the recorded poses", ({ timeline, poses }) => {
  const state = unpack(decodeBase64(timeline)) as TimelineState;
  for (const { clock, position, performers } of poses) {
    expect(positionAt(state, clock)).toBe(position);
    performers.forEach(({ root, rotations }, performer) => {
      const store = tracks.performers[performer]!;
      const pose = restPose();
      expect(store.poseAt(position, state.loop, pose, state.duration)).toBe(true);
      applyPlacement(pose, store.track.placement);
      root.forEach((value, i) => expect(Math.abs(pose.root[i] - value)).toBeLessThan(1e-9));
      rotations.forEach((value, i) => expect(Math.abs(pose.rotations[i] - value)).toBeLessThan(1e-9));
    });
  }
});
