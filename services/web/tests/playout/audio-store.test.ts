import { expect, test } from "vitest";
import { AudioTrack } from "../../src/codec/audio";
import { DamagedBlock } from "../../src/codec/errors";
import { parseTiming } from "../../src/codec/timing";
import { AudioBlockStore } from "../../src/playout/audio-store";
import { decodeBase64, loadVectors } from "../golden-vectors";

interface AudioVectors {
  motions: Record<string, unknown>[];
  tracks: Record<string, unknown>[];
  valid: { track: number; index: number; block: string; packets: { number: number; data: string }[] }[];
}

const golden = loadVectors<AudioVectors>("audio");

function store(which = 0): AudioBlockStore {
  return new AudioBlockStore(
    AudioTrack.fromDescription(golden.tracks[which], parseTiming(golden.motions[which], "motion")),
  );
}

test.each([0, 1, 2])(
  "packets of golden track %i are found by their numbers, blocks without any are here too",
  (which) => {
    const sounds = store(which);
    expect(sounds.packet(0)).toBeNull();
    for (const { index, block } of golden.valid.filter(({ track }) => track === which))
      expect(sounds.put(index, 0, decodeBase64(block))).toBe(true);
    const packets = golden.valid.filter(({ track }) => track === which).flatMap((vector) => vector.packets);
    expect(packets.map(({ number }) => [...sounds.packet(number)!])).toEqual(
      packets.map(({ data }) => [...decodeBase64(data)]),
    );
    expect(sounds.packet(packets.length)).toBeNull();
    expect(sounds.bufferedUs(0, false)).toBe(sounds.track.durationUs);
  },
);

test("a better rate takes the place of a lower one, and not the other way round", () => {
  const [first] = golden.valid;
  const block = decodeBase64(first.block);
  const other = block.slice();
  // the same packets, the last byte another
  other[other.length - 1] ^= 1;
  const sounds = store();
  sounds.put(0, 1, block);
  expect(sounds.put(0, 0, other)).toBe(false);
  const last = first.packets.at(-1)!;
  expect([...sounds.packet(last.number)!]).toEqual([...decodeBase64(last.data)]);
  expect(sounds.put(0, 2, other)).toBe(true);
  expect(sounds.packet(last.number)!.at(-1)).toBe(decodeBase64(last.data).at(-1)! ^ 1);
  // the message's memory is not kept
  other.fill(0);
  expect(sounds.packet(last.number)!.at(0)).toBe(decodeBase64(last.data).at(0));
});

test("packets beyond the track's are refused, and none of them kept", () => {
  const sounds = store();
  const { packetCount: packets } = sounds.track;
  // of one packet, numbered as no packet of this track is
  const beyond = Uint8Array.of((packets & 127) | 128, packets >> 7, 4, 0xfb, 0x43, 0xcf, 0xeb);
  expect(() => sounds.put(1, 0, beyond)).toThrow(DamagedBlock);
  expect(sounds.packet(packets)).toBeNull();
  expect(sounds.levels[1]).toBe(-1);
});
