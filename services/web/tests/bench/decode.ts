/**
 * Milliseconds to decode blocks: JSON on standard input, for `make bench-codec`. The last line printed is one JSON
 * object.
 */
import { readFileSync } from "node:fs";
import { decodeMotionBlock } from "../../src/codec/motion-decoder";
import { MotionTrack } from "../../src/codec/motion-track";
import { unpackSkeletonDescription } from "../../src/codec/skeleton-description";

interface Coded {
  track: { fps: number; frames: number; blockFrames: number; firstFrames: number; dancer: string };
  blocks: string[];
}

const bytes = (hex: string) => Uint8Array.from(Buffer.from(hex, "hex"));
const work = (JSON.parse(readFileSync(0, "utf8")) as Coded[]).flatMap(({ track, blocks }) => {
  const of = new MotionTrack(
    track.fps,
    track.frames,
    track.blockFrames,
    track.firstFrames,
    unpackSkeletonDescription(bytes(track.dancer)),
  );
  return blocks.map((block) => ({ of, block: bytes(block) }));
});

// the best of some rounds of each block: others share the machine
const spent = new Array<number>(work.length).fill(Infinity);
for (let round = 0; round < 5; round++) {
  work.forEach(({ of, block }, nth) => {
    const began = performance.now();
    decodeMotionBlock(of, block);
    spent[nth] = Math.min(spent[nth], performance.now() - began);
  });
}
spent.sort((a, b) => a - b);
console.log(
  JSON.stringify({ blocks: spent.length, median_ms: spent[spent.length >> 1], largest_ms: spent[spent.length - 1] }),
);
