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

function createStore(which = 0): AudioBlockStore {
  return new AudioBlockStore(
    AudioTrack.fromDescription(golden.tracks[which], parseTiming(golden.motions[which], "motion")),
  );
}

test.each([0, 1, 2])("packets of golden track %i are found by number", (which) => {
  const store = createStore(which);
  expect(store.packet(0)).toBeNull();
  for (const { index, block } of golden.valid.filter(({ track }) => track === which))
    expect(store.put(index, 0, decodeBase64(block))).toBe(true);
  const packets = golden.valid.filter(({ track }) => track === which).flatMap((vector) => vector.packets);
  expect(packets.map(({ number }) => [...store.packet(number)!])).toEqual(
    packets.map(({ data }) => [...decodeBase64(data)]),
  );
  expect(store.packet(packets.length)).toBeNull();
  expect(store.bufferedUs(0, false)).toBe(store.track.durationUs);
});

test("higher level replaces a lower one, not vice versa", () => {
  const [first] = golden.valid;
  const block = decodeBase64(first.block);
  const other = block.slice();
  // the same packets with another last byte
  other[other.length - 1] ^= 1;
  const store = createStore();
  store.put(0, 1, block);
  expect(store.put(0, 0, other)).toBe(false);
  const last = first.packets.at(-1)!;
  expect([...store.packet(last.number)!]).toEqual([...decodeBase64(last.data)]);
  expect(store.put(0, 2, other)).toBe(true);
  expect(store.packet(last.number)!.at(-1)).toBe(decodeBase64(last.data).at(-1)! ^ 1);
  // the packets were copied
  other.fill(0);
  expect(store.packet(last.number)!.at(0)).toBe(decodeBase64(last.data).at(0));
});

test("packets beyond the track are rejected and not stored", () => {
  const store = createStore();
  const { packetCount } = store.track;
  // one packet, with a number beyond the track
  const beyond = Uint8Array.of((packetCount & 127) | 128, packetCount >> 7, 4, 0xfb, 0x43, 0xcf, 0xeb);
  expect(() => store.put(1, 0, beyond)).toThrow(DamagedBlock);
  expect(store.packet(packetCount)).toBeNull();
  expect(store.levels[1]).toBe(-1);
});
