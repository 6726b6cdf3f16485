import { describe, expect, test } from "vitest";
import { DecodedPacketCache } from "../../src/audio/packet-cache";
import type { DecoderFactory, PacketHandler } from "../../src/audio/packet-decoder";
import { PACKET_SAMPLES } from "../../src/codec/audio";
import { createToneDecoder, createTrack, type DecoderCalls, packetSamples } from "./tone";

const track = createTrack(20, 2);
const here =
  (...numbers: number[]) =>
  (number: number) =>
    numbers.includes(number) ? Uint8Array.of(number) : null;
const range = (from: number, to: number) => Array.from({ length: to - from }, (_, at) => from + at);

describe("one decoder goes on", () => {
  test("from the beginning, packet by packet, each once", () => {
    const deeds: DecoderCalls = [];
    const sounds = new DecodedPacketCache(createToneDecoder(track, deeds).make, here(...range(0, 9)));
    sounds.decode([0, 1, 1, 2]);
    sounds.decode([1, 2, 3, 4]);
    expect(deeds).toEqual(["made", 0, 1, 2, 3, 4]);
    expect(sounds.get(4)).toEqual(packetSamples(track, 4));
    // nothing is faded in: the sound begins here
    expect(sounds.get(0)).toEqual(packetSamples(track, 0));
    sounds.close();
    expect(deeds.at(-1)).toBe("ended");
  });

  test("and what is decoded already is not asked for again while it is on its way", () => {
    const deeds: DecoderCalls = [];
    const { make, deliver } = createToneDecoder(track, deeds, { atOnce: false });
    const sounds = new DecodedPacketCache(make, here(...range(0, 9)));
    sounds.decode([0, 1]);
    sounds.decode([0, 1, 2]);
    expect(sounds.get(1)).toBeNull();
    deliver();
    expect(deeds).toEqual(["made", 0, 1, 2]);
    expect(sounds.get(2)).toEqual(packetSamples(track, 2));
  });
});

describe("where it does not go on it is made anew", () => {
  test("with the two packets before, which are not played", () => {
    const deeds: DecoderCalls = [];
    const sounds = new DecodedPacketCache(createToneDecoder(track, deeds).make, here(...range(0, 40)));
    sounds.decode([0, 20, 21, 1]);
    expect(deeds).toEqual(["made", 0, "ended", "made", 18, 19, 20, 21, "ended", "made", 0, 1]);
    expect([18, 19].map((number) => sounds.get(number))).toEqual([null, null]);
    expect(sounds.get(20)).toEqual(packetSamples(track, 20));
  });

  test("without them what comes first is faded in, and only that", () => {
    const deeds: DecoderCalls = [];
    const sounds = new DecodedPacketCache(createToneDecoder(track, deeds).make, here(19, 20, 21));
    sounds.decode([20, 21]);
    expect(deeds).toEqual(["made", 20, 21]);
    const [plain, faded] = [packetSamples(track, 20), sounds.get(20)!];
    faded.forEach((plane, channel) =>
      plane.forEach((sample, at) => expect(sample).toBeCloseTo((plain[channel][at] * at) / PACKET_SAMPLES, 6)),
    );
    expect(sounds.get(21)).toEqual(packetSamples(track, 21));
  });

  test("what the one before was still decoding is kept: a loop begins anew", () => {
    const { make, deliver } = createToneDecoder(track, [], { atOnce: false });
    const sounds = new DecodedPacketCache(make, here(...range(0, 40)));
    sounds.decode([30, 31, 0, 1]);
    deliver();
    expect([30, 31, 0, 1].every((number) => sounds.get(number))).toBe(true);
  });
});

test("packets that are not here are decoded once they are", () => {
  const deeds: DecoderCalls = [];
  const packets = new Map([
    [0, Uint8Array.of(0)],
    [2, Uint8Array.of(2)],
  ]);
  const sounds = new DecodedPacketCache(createToneDecoder(track, deeds).make, (number) => packets.get(number) ?? null);
  sounds.decode([0, 1, 2]);
  expect(sounds.get(1)).toBeNull();
  packets.set(1, Uint8Array.of(1));
  sounds.decode([0, 1, 2]);
  expect(sounds.get(1)).not.toBeNull();
});

test("a packet that cannot be decoded is silence, and not tried for ever", () => {
  const deeds: DecoderCalls = [];
  const sounds = new DecodedPacketCache(createToneDecoder(track, deeds, { broken: 1 }).make, here(0, 1, 2));
  sounds.decode([0, 1, 2]);
  sounds.decode([0, 1, 2]);
  expect(sounds.get(1)).toBeNull();
  expect(deeds).toEqual(["made", 0, 1, "ended", "made", 2]);
});

test("what a decoder was given beside a packet that ended it is decoded by another", () => {
  const deeds: DecoderCalls = [];
  const all: PacketHandler[] = [];
  const make: DecoderFactory = (emit) => {
    deeds.push("made");
    all.push(emit);
    return { decode: (number) => void deeds.push(number), close: () => void deeds.push("ended") };
  };
  const sounds = new DecodedPacketCache(make, here(0, 1, 2, 3));
  sounds.decode([0, 1, 2]);
  all[0](0, packetSamples(track, 0));
  all[0](1, null);
  sounds.decode([0, 1, 2, 3]);
  expect(deeds).toEqual(["made", 0, 1, 2, "ended", "made", 2, 3]);
  all[1](2, packetSamples(track, 2));
  expect(sounds.get(2)).not.toBeNull();
});

test("a packet before the first that ends the decoder is left out the next time", () => {
  const deeds: DecoderCalls = [];
  const all: PacketHandler[] = [];
  const make: DecoderFactory = (emit) => {
    deeds.push("made");
    all.push(emit);
    return { decode: (number) => void deeds.push(number), close: () => void deeds.push("ended") };
  };
  const sounds = new DecodedPacketCache(make, here(18, 19, 20));
  sounds.decode([20]);
  all[0](19, null);
  sounds.decode([20]);
  expect(deeds).toEqual(["made", 18, 19, 20, "ended", "made", 20]);
  all[1](20, packetSamples(track, 20));
  expect(sounds.get(20)).not.toBeNull();
});

test("the oldest is forgotten, eight seconds are kept", () => {
  const sounds = new DecodedPacketCache(createToneDecoder(track).make, (number) => Uint8Array.of(number & 255));
  sounds.decode(range(0, 200));
  expect(sounds.get(199)).not.toBeNull();
  expect(sounds.get(73)).not.toBeNull();
  expect(sounds.get(60)).toBeNull();
});
