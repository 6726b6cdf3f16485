import { describe, expect, test } from "vitest";
import { DecodedSound } from "../../src/audio/decoded";
import type { Emit, MakeDecoder } from "../../src/audio/packet-decoder";
import { PACKET } from "../../src/codec/audio";
import { type Deeds, packetSound, toneDecoder, trackOf } from "./tones";

const track = trackOf(20, 2);
const here = (...numbers: number[]) => (number: number) => (numbers.includes(number) ? Uint8Array.of(number) : null);
const range = (from: number, to: number) => Array.from({ length: to - from }, (_, at) => from + at);

describe("one decoder goes on", () => {
  test("from the beginning, packet by packet, each once", () => {
    const deeds: Deeds = [];
    const sounds = new DecodedSound(toneDecoder(track, deeds).make, here(...range(0, 9)));
    sounds.want([0, 1, 1, 2]);
    sounds.want([1, 2, 3, 4]);
    expect(deeds).toEqual(["made", 0, 1, 2, 3, 4]);
    expect(sounds.sound(4)).toEqual(packetSound(track, 4));
    // nothing is faded in: the sound begins here
    expect(sounds.sound(0)).toEqual(packetSound(track, 0));
    sounds.close();
    expect(deeds.at(-1)).toBe("ended");
  });

  test("and what is decoded already is not asked for again while it is on its way", () => {
    const deeds: Deeds = [];
    const { make, deliver } = toneDecoder(track, deeds, { atOnce: false });
    const sounds = new DecodedSound(make, here(...range(0, 9)));
    sounds.want([0, 1]);
    sounds.want([0, 1, 2]);
    expect(sounds.sound(1)).toBeNull();
    deliver();
    expect(deeds).toEqual(["made", 0, 1, 2]);
    expect(sounds.sound(2)).toEqual(packetSound(track, 2));
  });
});

describe("where it does not go on it is made anew", () => {
  test("with the two packets before, which are not played", () => {
    const deeds: Deeds = [];
    const sounds = new DecodedSound(toneDecoder(track, deeds).make, here(...range(0, 40)));
    sounds.want([0, 20, 21, 1]);
    expect(deeds).toEqual(["made", 0, "ended", "made", 18, 19, 20, 21, "ended", "made", 0, 1]);
    expect([18, 19].map((number) => sounds.sound(number))).toEqual([null, null]);
    expect(sounds.sound(20)).toEqual(packetSound(track, 20));
  });

  test("without them what comes first is faded in, and only that", () => {
    const deeds: Deeds = [];
    const sounds = new DecodedSound(toneDecoder(track, deeds).make, here(19, 20, 21));
    sounds.want([20, 21]);
    expect(deeds).toEqual(["made", 20, 21]);
    const [plain, faded] = [packetSound(track, 20), sounds.sound(20)!];
    faded.forEach((plane, channel) => plane.forEach((sample, at) => expect(sample).toBeCloseTo((plain[channel][at] * at) / PACKET, 6)));
    expect(sounds.sound(21)).toEqual(packetSound(track, 21));
  });

  test("what the one before was still decoding is kept: a loop begins anew", () => {
    const { make, deliver } = toneDecoder(track, [], { atOnce: false });
    const sounds = new DecodedSound(make, here(...range(0, 40)));
    sounds.want([30, 31, 0, 1]);
    deliver();
    expect([30, 31, 0, 1].every((number) => sounds.sound(number))).toBe(true);
  });
});

test("packets that are not here are decoded once they are", () => {
  const deeds: Deeds = [];
  const packets = new Map([[0, Uint8Array.of(0)], [2, Uint8Array.of(2)]]);
  const sounds = new DecodedSound(toneDecoder(track, deeds).make, (number) => packets.get(number) ?? null);
  sounds.want([0, 1, 2]);
  expect(sounds.sound(1)).toBeNull();
  packets.set(1, Uint8Array.of(1));
  sounds.want([0, 1, 2]);
  expect(sounds.sound(1)).not.toBeNull();
});

test("a packet that cannot be decoded is silence, and not tried for ever", () => {
  const deeds: Deeds = [];
  const sounds = new DecodedSound(toneDecoder(track, deeds, { broken: 1 }).make, here(0, 1, 2));
  sounds.want([0, 1, 2]);
  sounds.want([0, 1, 2]);
  expect(sounds.sound(1)).toBeNull();
  expect(deeds).toEqual(["made", 0, 1, "ended", "made", 2]);
});

test("what a decoder was given beside a packet that ended it is decoded by another", () => {
  const deeds: Deeds = [];
  const all: Emit[] = [];
  const make: MakeDecoder = (emit) => {
    deeds.push("made");
    all.push(emit);
    return { decode: (number) => void deeds.push(number), end: () => void deeds.push("ended") };
  };
  const sounds = new DecodedSound(make, here(0, 1, 2, 3));
  sounds.want([0, 1, 2]);
  all[0](0, packetSound(track, 0));
  all[0](1, null);
  sounds.want([0, 1, 2, 3]);
  expect(deeds).toEqual(["made", 0, 1, 2, "ended", "made", 2, 3]);
  all[1](2, packetSound(track, 2));
  expect(sounds.sound(2)).not.toBeNull();
});

test("a packet before the first that ends the decoder is left out the next time", () => {
  const deeds: Deeds = [];
  const all: Emit[] = [];
  const make: MakeDecoder = (emit) => {
    deeds.push("made");
    all.push(emit);
    return { decode: (number) => void deeds.push(number), end: () => void deeds.push("ended") };
  };
  const sounds = new DecodedSound(make, here(18, 19, 20));
  sounds.want([20]);
  all[0](19, null);
  sounds.want([20]);
  expect(deeds).toEqual(["made", 18, 19, 20, "ended", "made", 20]);
  all[1](20, packetSound(track, 20));
  expect(sounds.sound(20)).not.toBeNull();
});

test("the oldest is forgotten, eight seconds are kept", () => {
  const sounds = new DecodedSound(toneDecoder(track).make, (number) => Uint8Array.of(number & 255));
  sounds.want(range(0, 200));
  expect(sounds.sound(199)).not.toBeNull();
  expect(sounds.sound(73)).not.toBeNull();
  expect(sounds.sound(60)).toBeNull();
});
