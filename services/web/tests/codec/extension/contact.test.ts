import { expect, test } from "vitest";
import { DamagedBlock } from "../../../src/codec/errors";
import { ContactTrack, decodeContactBlock } from "../../../src/codec/extension/contact";
import { contactVectors, goldenContactTracks } from "../../golden-contacts";
import { decodeBase64 } from "../../golden-vectors";
import { HostileInputCounts } from "../../hostile-input";

const golden = contactVectors();
const tracks = goldenContactTracks();

test("golden blocks decode as recorded", () => {
  for (const { track, index, block, left, right } of golden.valid) {
    const { planted, frames } = decodeContactBlock(decodeBase64(block), tracks[track].framesIn(index));
    expect(frames).toBe(left.length);
    expect([...planted]).toEqual(left.map((contact, frame) => contact | (right[frame] << 1)));
  }
});

test.each(golden.invalid)("a block with $why is refused", ({ block, index }) => {
  expect(() => decodeContactBlock(decodeBase64(block), tracks[0].framesIn(index))).toThrow(DamagedBlock);
});

test.each([true, false, 0.5, "0", -1])("a track of performer %j is refused", (performer) => {
  expect(() => ContactTrack.fromDescription({ ...golden.tracks[0], performer })).toThrow(/index/);
});

test.each(golden.invalid_tracks)("a track with $why is refused", ({ track }) => {
  expect(() => ContactTrack.fromDescription(track)).toThrow(DamagedBlock);
});

test("any bytes are decoded or refused", () => {
  const counts = new HostileInputCounts(DamagedBlock);
  let state = 1;
  const random = (limit: number) => (state = (state * 48271) % 2147483647) % limit;
  for (let n = 0; n < 20_000; n++) {
    const bytes = Uint8Array.from({ length: random(10) }, () => random(n % 2 ? 256 : 24));
    const frames = 1 + random(40);
    counts.run(() => expect(decodeContactBlock(bytes, frames).frames).toBe(frames));
  }
  counts.print("contacts");
});
