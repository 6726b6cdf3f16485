import { describe, expect, test } from "vitest";
import { DecodedPacketCache } from "../../src/audio/packet-cache";
import type { DecoderFactory, PacketHandler } from "../../src/audio/packet-decoder";
import { PACKET_SAMPLES } from "../../src/codec/audio";
import { createToneDecoder, createTrack, type DecoderCalls, packetSamples } from "./tone";

const track = createTrack(20, 2);
const packetsOf =
  (...numbers: number[]) =>
  (number: number) =>
    numbers.includes(number) ? Uint8Array.of(number) : null;
const range = (from: number, to: number) => Array.from({ length: to - from }, (_, at) => from + at);

describe("one decoder continues", () => {
  test("from the start, each packet once", () => {
    const calls: DecoderCalls = [];
    const cache = new DecodedPacketCache(createToneDecoder(track, calls).createDecoder, packetsOf(...range(0, 9)));
    cache.decode([0, 1, 1, 2]);
    cache.decode([1, 2, 3, 4]);
    expect(calls).toEqual(["made", 0, 1, 2, 3, 4]);
    expect(cache.get(4)).toEqual(packetSamples(track, 4));
    // Nothing is faded in: the sound begins here.
    expect(cache.get(0)).toEqual(packetSamples(track, 0));
    cache.close();
    expect(calls.at(-1)).toBe("ended");
  });

  test("and packets being decoded are not requested again", () => {
    const calls: DecoderCalls = [];
    const { createDecoder, deliver } = createToneDecoder(track, calls, { atOnce: false });
    const cache = new DecodedPacketCache(createDecoder, packetsOf(...range(0, 9)));
    cache.decode([0, 1]);
    cache.decode([0, 1, 2]);
    expect(cache.get(1)).toBeNull();
    deliver();
    expect(calls).toEqual(["made", 0, 1, 2]);
    expect(cache.get(2)).toEqual(packetSamples(track, 2));
  });
});

describe("a new decoder starts after a jump", () => {
  test("with two warm-up packets that are not kept", () => {
    const calls: DecoderCalls = [];
    const cache = new DecodedPacketCache(createToneDecoder(track, calls).createDecoder, packetsOf(...range(0, 40)));
    cache.decode([0, 20, 21, 1]);
    expect(calls).toEqual(["made", 0, "ended", "made", 18, 19, 20, 21, "ended", "made", 0, 1]);
    expect([18, 19].map((number) => cache.get(number))).toEqual([null, null]);
    expect(cache.get(20)).toEqual(packetSamples(track, 20));
  });

  test("with a fade-in if there are no warm-up packets", () => {
    const calls: DecoderCalls = [];
    const cache = new DecodedPacketCache(createToneDecoder(track, calls).createDecoder, packetsOf(19, 20, 21));
    cache.decode([20, 21]);
    expect(calls).toEqual(["made", 20, 21]);
    const [plain, faded] = [packetSamples(track, 20), cache.get(20)!];
    faded.forEach((plane, channel) =>
      plane.forEach((sample, at) => expect(sample).toBeCloseTo((plain[channel][at] * at) / PACKET_SAMPLES, 6)),
    );
    expect(cache.get(21)).toEqual(packetSamples(track, 21));
  });

  test("while the last one's pending packets are kept, as in a loop", () => {
    const { createDecoder, deliver } = createToneDecoder(track, [], { atOnce: false });
    const cache = new DecodedPacketCache(createDecoder, packetsOf(...range(0, 40)));
    cache.decode([30, 31, 0, 1]);
    deliver();
    expect([30, 31, 0, 1].every((number) => cache.get(number))).toBe(true);
  });
});

test("missing packets are decoded once they arrive", () => {
  const calls: DecoderCalls = [];
  const packets = new Map([
    [0, Uint8Array.of(0)],
    [2, Uint8Array.of(2)],
  ]);
  const cache = new DecodedPacketCache(
    createToneDecoder(track, calls).createDecoder,
    (number) => packets.get(number) ?? null,
  );
  cache.decode([0, 1, 2]);
  expect(cache.get(1)).toBeNull();
  packets.set(1, Uint8Array.of(1));
  cache.decode([0, 1, 2]);
  expect(cache.get(1)).not.toBeNull();
});

test("a packet that cannot be decoded is silent and not retried", () => {
  const calls: DecoderCalls = [];
  const cache = new DecodedPacketCache(
    createToneDecoder(track, calls, { broken: 1 }).createDecoder,
    packetsOf(0, 1, 2),
  );
  cache.decode([0, 1, 2]);
  cache.decode([0, 1, 2]);
  expect(cache.get(1)).toBeNull();
  expect(calls).toEqual(["made", 0, 1, "ended", "made", 2]);
});

test("other packets of a failed decoder are decoded by another", () => {
  const calls: DecoderCalls = [];
  const handlers: PacketHandler[] = [];
  const createDecoder: DecoderFactory = (emit) => {
    calls.push("made");
    handlers.push(emit);
    return { decode: (number) => void calls.push(number), close: () => void calls.push("ended") };
  };
  const cache = new DecodedPacketCache(createDecoder, packetsOf(0, 1, 2, 3));
  cache.decode([0, 1, 2]);
  handlers[0](0, packetSamples(track, 0));
  handlers[0](1, null);
  cache.decode([0, 1, 2, 3]);
  expect(calls).toEqual(["made", 0, 1, 2, "ended", "made", 2, 3]);
  handlers[1](2, packetSamples(track, 2));
  expect(cache.get(2)).not.toBeNull();
});

test("a warm-up packet that fails is left out the next time", () => {
  const calls: DecoderCalls = [];
  const handlers: PacketHandler[] = [];
  const createDecoder: DecoderFactory = (emit) => {
    calls.push("made");
    handlers.push(emit);
    return { decode: (number) => void calls.push(number), close: () => void calls.push("ended") };
  };
  const cache = new DecodedPacketCache(createDecoder, packetsOf(18, 19, 20));
  cache.decode([20]);
  handlers[0](19, null);
  cache.decode([20]);
  expect(calls).toEqual(["made", 18, 19, 20, "ended", "made", 20]);
  handlers[1](20, packetSamples(track, 20));
  expect(cache.get(20)).not.toBeNull();
});

test("the oldest packets are dropped, 8 s are kept", () => {
  const cache = new DecodedPacketCache(createToneDecoder(track).createDecoder, (number) => Uint8Array.of(number & 255));
  cache.decode(range(0, 200));
  expect(cache.get(199)).not.toBeNull();
  expect(cache.get(73)).not.toBeNull();
  expect(cache.get(60)).toBeNull();
});
