import { afterEach, describe, expect, test, vi } from "vitest";
import { DamagedBlock } from "../../src/codec/errors";
import { TrackSet } from "../../src/playout/track-set";
import type { Track } from "../../src/wire/messages";
import { goldenDescription } from "../golden-motion";
import { goldenScene } from "../golden-scenes";
import { loadVectors } from "../golden-vectors";

afterEach(() => void vi.restoreAllMocks());

test("stores are found by track index", () => {
  const tracks = new TrackSet([goldenScene(1), { type: "song" }, goldenDescription(), goldenScene(0)]);
  expect(tracks.store(2)).toBe(tracks.firstPerformer);
  expect(tracks.firstPerformer.track.durationUs).toBe(2_600_000);
  expect(tracks.scenes.map((store) => store.track.kind)).toEqual(["light", "camera"]);
  expect([tracks.store(0), tracks.store(3)]).toEqual(tracks.scenes);
  expect([1, 4, 5, 15].map((track) => tracks.store(track))).toEqual([null, null, null, null]);
});

describe("several performers", () => {
  test("are the motion tracks in the Description's order", () => {
    const tracks = new TrackSet([
      goldenDescription(1),
      goldenScene(),
      goldenDescription(),
      { ...goldenDescription(2), place: [1, -2, 0.5] },
    ]);
    expect(tracks.performers.map((store) => store!.track.durationUs)).toEqual([1_101_101, 2_600_000, 833_333]);
    expect(tracks.performers.map((store) => store!.track.placement.x)).toEqual([0, 0, 1]);
    expect([0, 2, 3].map((track) => tracks.store(track))).toEqual(tracks.performers);
    expect(tracks.performers[0]).toBe(tracks.firstPerformer);
  });

  test("keep their numbers if one cannot be played", () => {
    const warn = vi.spyOn(console, "warn").mockReturnValue();
    const far = { ...goldenDescription(), place: [0, 101, 0] };
    const tracks = new TrackSet([goldenDescription(), far, goldenDescription(1)]);
    expect(tracks.performers.map((store) => store?.track.frames)).toEqual([78, undefined, 66]);
    expect(tracks.performers[1]).toBeNull();
    expect([1, 2].map((track) => tracks.store(track))).toEqual([null, tracks.performers[2]]);
    expect(warn.mock.calls[0][0]).toContain(
      "Skipped track 1 (motion) of the stream: Invalid motion track: place must be within 100 metres",
    );
  });

  test("are rejected if the first one cannot be played", () => {
    expect(() => new TrackSet([{ ...goldenDescription(), place: [0] }, goldenDescription(1)])).toThrow(
      "motion track: place must",
    );
  });

  test("are at most four, including those that cannot be played", () => {
    const warn = vi.spyOn(console, "warn").mockReturnValue();
    const tracks = new TrackSet([
      goldenDescription(),
      { ...goldenDescription(), codec: "?" },
      goldenDescription(),
      goldenDescription(),
      goldenDescription(),
      { ...goldenDescription(), codec: "?" },
    ]);
    expect(tracks.performers.map((store) => store !== null)).toEqual([true, false, true, true]);
    expect([tracks.store(4), tracks.store(5), warn.mock.calls.length]).toEqual([null, null, 1]);
  });

  test("may be described later, and none is added twice", () => {
    const tracks = new TrackSet([goldenDescription()]);
    const others = [goldenScene(), goldenDescription(1), goldenDescription(2)];
    tracks.add(1, others.slice(0, 2));
    expect(tracks.performers).toHaveLength(2);
    tracks.add(0, [goldenDescription(), ...others]);
    tracks.add(0, [goldenDescription(), ...others]);
    expect(tracks.performers.map((store) => store!.track.frames)).toEqual([78, 66, 20]);
    expect([0, 2, 3].map((track) => tracks.store(track))).toEqual(tracks.performers);
  });
});

test("tracks that are described later are found, and none is added twice", () => {
  const [audio] = loadVectors<{ tracks: Track[] }>("audio").tracks;
  const tracks = new TrackSet([goldenDescription()]);
  expect([tracks.describedCount, tracks.scenes.length, tracks.audio]).toEqual([1, 0, null]);
  tracks.add(1, [audio, goldenScene(1)]);
  const { firstPerformer } = tracks;
  tracks.add(0, [goldenDescription(), audio, goldenScene(1), goldenScene(0)]);
  expect(tracks.scenes.map((store) => store.track.kind)).toEqual(["light", "camera"]);
  expect([0, 1, 2, 3].map((track) => tracks.store(track))).toEqual([firstPerformer, tracks.audio, ...tracks.scenes]);
  expect(tracks.describedCount).toBe(4);
});

test("camera that cannot be decoded is skipped", () => {
  const warn = vi.spyOn(console, "warn").mockReturnValue();
  const tracks = new TrackSet([goldenDescription(), { ...goldenScene(), codec: "bunraku.scene/9" }, goldenScene(1)]);
  expect(tracks.scenes.map((store) => store.track.kind)).toEqual(["light"]);
  expect(tracks.store(1)).toBeNull();
  expect(warn.mock.calls[0][0]).toContain("bunraku.scene/9");
});

test("first audio track is used; one that cannot be decoded is skipped", () => {
  const [audio] = loadVectors<{ tracks: Track[] }>("audio").tracks;
  const tracks = new TrackSet([audio, goldenDescription(), { ...audio, channels: 1 }]);
  expect(tracks.audio?.track.channels).toBe(2);
  expect(tracks.audio?.track.blockCount).toBe(tracks.firstPerformer.track.blockCount);
  expect([tracks.store(0), tracks.store(2)]).toEqual([tracks.audio, null]);
  const warn = vi.spyOn(console, "warn").mockReturnValue();
  expect(new TrackSet([goldenDescription(), { ...audio, codec: "bunraku.audio/9" }]).audio).toBeNull();
  expect(warn.mock.calls[0][0]).toContain("bunraku.audio/9");
});

test("stream without a motion track is rejected", () => {
  expect(() => new TrackSet([goldenScene()])).toThrow(DamagedBlock);
  expect(() => new TrackSet([])).toThrow("The stream has no motion track");
});
