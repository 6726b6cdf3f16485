/**
 * Decoding time of motion blocks, for `make bench-codec`. Reads JSON from standard input and prints a JSON object as
 * its last line.
 */
import { readFileSync } from "node:fs";
import { decodeMotionBlock } from "../../src/codec/motion-decoder";
import { MotionTrack } from "../../src/codec/motion-track";
import { unpackSkeletonDescription } from "../../src/codec/skeleton-description";

interface EncodedTrack {
  track: { fps: number; frames: number; blockFrames: number; firstFrames: number; dancer: string };
  blocks: string[];
}

const fromHex = (hex: string) => Uint8Array.from(Buffer.from(hex, "hex"));
const work = (JSON.parse(readFileSync(0, "utf8")) as EncodedTrack[]).flatMap(({ track, blocks }) => {
  const motionTrack = new MotionTrack(
    track.fps,
    track.frames,
    track.blockFrames,
    track.firstFrames,
    unpackSkeletonDescription(fromHex(track.dancer)),
  );
  return blocks.map((block) => ({ motionTrack, block: fromHex(block) }));
});

// Keep the fastest of five rounds of each block, because other processes share the machine.
const durations = new Array<number>(work.length).fill(Infinity);
for (let round = 0; round < 5; round++) {
  work.forEach(({ motionTrack, block }, nth) => {
    const start = performance.now();
    decodeMotionBlock(motionTrack, block);
    durations[nth] = Math.min(durations[nth], performance.now() - start);
  });
}
durations.sort((a, b) => a - b);
console.log(
  JSON.stringify({
    blocks: durations.length,
    median_ms: durations[durations.length >> 1],
    largest_ms: durations[durations.length - 1],
  }),
);
