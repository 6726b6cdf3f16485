import { afterEach, expect, test, vi } from "vitest";
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
