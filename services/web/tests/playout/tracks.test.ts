import { afterEach, expect, test, vi } from "vitest";
import { DamagedBlock } from "../../src/codec/errors";
import { Tracks } from "../../src/playout/tracks";
import { goldenDescription } from "../golden";
import { goldenScene } from "../scenes";

afterEach(() => void vi.restoreAllMocks());

test("each track is found by its index, the dance and the scenes beside it", () => {
  const tracks = new Tracks([goldenScene(1), { type: "audio" }, goldenDescription(), goldenScene(0), goldenDescription(1)]);
  expect(tracks.store(2)).toBe(tracks.dance);
  expect(tracks.dance.track.durationUs).toBe(2_600_000);
  expect(tracks.scenes.map((store) => store.track.kind)).toEqual(["light", "camera"]);
  expect([tracks.store(0), tracks.store(3)]).toEqual(tracks.scenes);
  expect([1, 4, 5, 15].map((track) => tracks.store(track))).toEqual([null, null, null, null]);
});

test("a camera that cannot be read is left out, and the dance goes on", () => {
  const warned = vi.spyOn(console, "warn").mockReturnValue();
  const tracks = new Tracks([goldenDescription(), { ...goldenScene(), codec: "bunraku.scene/9" }, goldenScene(1)]);
  expect(tracks.scenes.map((store) => store.track.kind)).toEqual(["light"]);
  expect(tracks.store(1)).toBeNull();
  expect(warned.mock.calls[0][0]).toContain("bunraku.scene/9");
});

test("without a dance there is nothing to show", () => {
  expect(() => new Tracks([goldenScene()])).toThrow(DamagedBlock);
  expect(() => new Tracks([])).toThrow("the stream has no motion in it");
});
