import { expect, test } from "vitest";
import { DamagedBlock } from "../../../src/codec/errors";
import { decodePropBlock, PropTrack } from "../../../src/codec/extension/props";
import { goldenPropTracks, propVectors } from "../../golden-props";
import { decodeBase64 } from "../../golden-vectors";
import { HostileInputCounts } from "../../hostile-input";

const golden = propVectors();
const tracks = goldenPropTracks();

test("golden blocks decode as recorded", () => {
  for (const { track, index, block, frames, runs } of golden.valid) {
    const { kinds } = tracks[track];
    const decoded = decodePropBlock(decodeBase64(block), kinds.length, tracks[track].framesIn(index));
    expect(decoded.frames).toBe(frames);
    decoded.states.forEach((states, prop) => {
      states.forEach((state, frame) => {
        const [, expected] = runs[prop].findLast(([first]) => first <= frame)!;
        expect(state && [state.limb, state.place]).toEqual(expected);
      });
    });
  }
});

test.each(golden.invalid)("a block with $why is refused", ({ block, index }) => {
  const { kinds } = tracks[0];
  expect(() => decodePropBlock(decodeBase64(block), kinds.length, tracks[0].framesIn(index))).toThrow(DamagedBlock);
});

test.each(golden.invalid_tracks)("a track with $why is refused", ({ track }) => {
  expect(() => PropTrack.fromDescription(track)).toThrow(DamagedBlock);
});

test("any bytes are decoded or refused", () => {
  const counts = new HostileInputCounts(DamagedBlock);
  let state = 1;
  const random = (limit: number) => (state = (state * 48271) % 2147483647) % limit;
  for (let n = 0; n < 20_000; n++) {
    const bytes = Uint8Array.from({ length: random(24) }, () => random(n % 2 ? 256 : 8));
    const frames = 1 + random(20);
    counts.run(() => expect(decodePropBlock(bytes, 1 + random(2), frames).frames).toBe(frames));
  }
  counts.print("props");
});
