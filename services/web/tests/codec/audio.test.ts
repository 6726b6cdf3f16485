import * as fc from "fast-check";
import { describe, expect, test } from "vitest";
import {
  type AudioPacket,
  AudioTrack,
  PACKET_SAMPLES,
  packetDurationMs,
  unpackAudioBlock,
} from "../../src/codec/audio";
import { DamagedBlock } from "../../src/codec/errors";
import { parseTiming } from "../../src/codec/timing";
import { decodeBase64, loadVectors } from "../golden-vectors";

interface AudioVectors {
  /** Timing of the motion of each track. */
  motions: Record<string, unknown>[];
  tracks: Record<string, unknown>[];
  valid: { track: number; index: number; block: string; packets: { number: number; sample: number; data: string }[] }[];
  invalid: { why: string; block: string }[];
}

const golden = loadVectors<AudioVectors>("audio");
const motions = golden.motions.map((map) => parseTiming(map, "motion"));
const tracks = golden.tracks.map((map, index) => AudioTrack.fromDescription(map, motions[index]));

describe("golden blocks", () => {
  test.each(golden.valid)("block $index of track $track", (vector) => {
    const track = tracks[vector.track];
    const packets = unpackAudioBlock(decodeBase64(vector.block));
    expect(packets.map(({ number, data }) => [number, track.firstSample(number), [...data]])).toEqual(
      vector.packets.map(({ number, sample, data }) => [number, sample, [...decodeBase64(data)]]),
    );
    for (const { number } of packets) {
      expect(track.blockAt(track.packetStartUs(number))).toBe(vector.index);
      expect(track.packetAt(track.packetStartUs(number) + 1)).toBe(number);
      expect(track.packetAt(track.packetStartUs(number + 1) - 1)).toBe(number);
    }
  });

  test.each(golden.invalid)("refuses: $why", ({ block }) => {
    expect(() => unpackAudioBlock(decodeBase64(block))).toThrow(DamagedBlock);
  });

  test("contain all packets of a track in order", () => {
    tracks.forEach((track, trackIndex) => {
      const blocks = golden.valid.filter((vector) => vector.track === trackIndex);
      expect(blocks.map(({ index }) => index)).toEqual([...Array(track.blockCount).keys()]);
      const numbers = blocks.flatMap(({ block }) => unpackAudioBlock(decodeBase64(block))).map(({ number }) => number);
      expect(numbers).toEqual([...Array(track.packetCount).keys()]);
      expect(track.firstSample(track.packetCount - 1)).toBeLessThan(track.samples);
      expect(track.firstSample(track.packetCount)).toBeGreaterThanOrEqual(track.samples);
    });
    expect(golden.valid.some(({ packets }) => packets.length === 0)).toBe(true);
  });
});

test("damaged block is refused or contains packets of 60 ms", () => {
  const blocks = golden.valid.map(({ block }) => decodeBase64(block)).filter(({ length }) => length > 0);
  const change = fc.tuple(fc.nat(), fc.nat(255));
  let accepted = 0,
    refused = 0;
  const expectPacketsOrRefusal = (data: Uint8Array): void => {
    let packets: AudioPacket[];
    try {
      packets = unpackAudioBlock(data);
    } catch (error) {
      if (!(error instanceof DamagedBlock)) throw error;
      refused++;
      return;
    }
    accepted++;
    for (const packet of packets) expect(packetDurationMs(packet.data)).toBe(60);
    expect(packets.reduce((sum, packet) => sum + packet.data.length, 0)).toBeLessThanOrEqual(data.length);
  };
  fc.assert(
    fc.property(
      fc.constantFrom(...blocks),
      fc.array(change, { minLength: 1, maxLength: 3 }),
      fc.double({ min: 0, max: 1, noNaN: true }),
      fc.uint8Array({ maxLength: 40 }),
      (valid, changes, part, random) => {
        const damaged = valid.slice();
        for (const [position, value] of changes) damaged[position % damaged.length] = value;
        expectPacketsOrRefusal(damaged);
        expectPacketsOrRefusal(valid.subarray(0, Math.floor(part * valid.length)));
        expectPacketsOrRefusal(random);
      },
    ),
    { numRuns: 500 },
  );
  expect(accepted).toBeGreaterThan(50);
  expect(refused).toBeGreaterThan(50);
});

describe("invalid description is refused with a reason", () => {
  test.each([
    [{ codec: "opus" }, "codec opus"],
    [{ channels: 3 }, "channels"],
    [{ channels: 1.5 }, "channels"],
    [{ pre_skip: -1 }, "pre_skip"],
    [{ pre_skip: 2 * PACKET_SAMPLES + 1 }, "pre_skip"],
    [{ samples: 0 }, "samples"],
    [{ samples: 2 ** 60 }, "samples"],
    [{ samples: "9" }, "samples"],
    [{ rates: [] }, "rates"],
    [{ rates: [{ kbps: 8 }, null] }, "rate 1"],
    [{ rates: [{ kbps: "8" }] }, "rate 0"],
  ])("%o", (change, message) => {
    const parse = () => AudioTrack.fromDescription({ ...golden.tracks[0], ...change }, motions[0]);
    expect(parse).toThrow(DamagedBlock);
    expect(parse).toThrow(message);
  });
});
