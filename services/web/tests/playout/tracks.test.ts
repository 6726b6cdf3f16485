import { afterEach, describe, expect, test, vi } from "vitest";
import { DamagedBlock } from "../../src/codec/errors";
import { Tracks } from "../../src/playout/tracks";
import { goldenDescription } from "../golden";
import type { Track } from "../../src/wire/messages";
import { goldenScene } from "../scenes";
import { vectors } from "../vectors";

afterEach(() => void vi.restoreAllMocks());

test("each track is found by its index, the dance and the scenes beside it", () => {
  const tracks = new Tracks([goldenScene(1), { type: "song" }, goldenDescription(), goldenScene(0)]);
  expect(tracks.store(2)).toBe(tracks.dance);
  expect(tracks.dance.track.durationUs).toBe(2_600_000);
  expect(tracks.scenes.map((store) => store.track.kind)).toEqual(["light", "camera"]);
  expect([tracks.store(0), tracks.store(3)]).toEqual(tracks.scenes);
  expect([1, 4, 5, 15].map((track) => tracks.store(track))).toEqual([null, null, null, null]);
});

describe("several performers", () => {
  test("are one for each motion, in the Description's order, the first the show's", () => {
    const tracks = new Tracks([goldenDescription(1), goldenScene(), goldenDescription(), { ...goldenDescription(2), place: [1, -2, 0.5] }]);
    expect(tracks.performers.map((store) => store!.track.durationUs)).toEqual([1_101_101, 2_600_000, 833_333]);
    expect(tracks.performers.map((store) => store!.track.place.x)).toEqual([0, 0, 1]);
    expect([0, 2, 3].map((track) => tracks.store(track))).toEqual(tracks.performers);
    expect(tracks.performers[0]).toBe(tracks.dance);
  });

  test("of whom one cannot be read keep their numbers", () => {
    const warned = vi.spyOn(console, "warn").mockReturnValue();
    const far = { ...goldenDescription(), place: [0, 101, 0] };
    const tracks = new Tracks([goldenDescription(), far, goldenDescription(1)]);
    expect(tracks.performers.map((store) => store?.track.frames)).toEqual([78, undefined, 66]);
    expect(tracks.performers[1]).toBeNull();
    expect([1, 2].map((track) => tracks.store(track))).toEqual([null, tracks.performers[2]]);
    expect(warned.mock.calls[0][0]).toContain("the motion at 1 of this stream is left out: motion needs a place within 100 metres");
  });

  test("of whom the first cannot be read are no show", () => {
    expect(() => new Tracks([{ ...goldenDescription(), place: [0] }, goldenDescription(1)])).toThrow("motion needs a place");
  });

  test("are four at most, those that cannot be read among them", () => {
    const warned = vi.spyOn(console, "warn").mockReturnValue();
    const tracks = new Tracks([goldenDescription(), { ...goldenDescription(), codec: "?" }, goldenDescription(), goldenDescription(), goldenDescription(), { ...goldenDescription(), codec: "?" }]);
    expect(tracks.performers.map((store) => store !== null)).toEqual([true, false, true, true]);
    expect([tracks.store(4), tracks.store(5), warned.mock.calls.length]).toEqual([null, null, 1]);
  });

  test("may be told of later, one by one, and none is counted twice", () => {
    const tracks = new Tracks([goldenDescription()]);
    const others = [goldenScene(), goldenDescription(1), goldenDescription(2)];
    tracks.add(1, others.slice(0, 2));
    expect(tracks.performers).toHaveLength(2);
    tracks.add(0, [goldenDescription(), ...others]);
    tracks.add(0, [goldenDescription(), ...others]);
    expect(tracks.performers.map((store) => store!.track.frames)).toEqual([78, 66, 20]);
    expect([0, 2, 3].map((track) => tracks.store(track))).toEqual(tracks.performers);
  });
});

test("tracks that are told of later are found by their index too, and none is told of twice", () => {
  const [sound] = vectors<{ tracks: Track[] }>("audio").tracks;
  const tracks = new Tracks([goldenDescription()]);
  expect([tracks.told, tracks.scenes.length, tracks.sound]).toEqual([1, 0, null]);
  tracks.add(1, [sound, goldenScene(1)]);
  const { dance } = tracks;
  tracks.add(0, [goldenDescription(), sound, goldenScene(1), goldenScene(0)]);
  expect(tracks.scenes.map((store) => store.track.kind)).toEqual(["light", "camera"]);
  expect([0, 1, 2, 3].map((track) => tracks.store(track))).toEqual([dance, tracks.sound, ...tracks.scenes]);
  expect(tracks.told).toBe(4);
});

test("a camera that cannot be read is left out, and the dance goes on", () => {
  const warned = vi.spyOn(console, "warn").mockReturnValue();
  const tracks = new Tracks([goldenDescription(), { ...goldenScene(), codec: "bunraku.scene/9" }, goldenScene(1)]);
  expect(tracks.scenes.map((store) => store.track.kind)).toEqual(["light"]);
  expect(tracks.store(1)).toBeNull();
  expect(warned.mock.calls[0][0]).toContain("bunraku.scene/9");
});

test("the first sound is the show's, timed as the dance; one that cannot be read is left out", () => {
  const [sound] = vectors<{ tracks: Track[] }>("audio").tracks;
  const tracks = new Tracks([sound, goldenDescription(), { ...sound, channels: 1 }]);
  expect(tracks.sound?.track.channels).toBe(2);
  expect(tracks.sound?.track.blocks).toBe(tracks.dance.track.blocks);
  expect([tracks.store(0), tracks.store(2)]).toEqual([tracks.sound, null]);
  const warned = vi.spyOn(console, "warn").mockReturnValue();
  expect(new Tracks([goldenDescription(), { ...sound, codec: "bunraku.audio/9" }]).sound).toBeNull();
  expect(warned.mock.calls[0][0]).toContain("bunraku.audio/9");
});

test("without a dance there is nothing to show", () => {
  expect(() => new Tracks([goldenScene()])).toThrow(DamagedBlock);
  expect(() => new Tracks([])).toThrow("the stream has no motion in it");
});
