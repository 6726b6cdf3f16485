import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { browserSoundPreference } from "../../src/audio/preference";
import { forbidStorage, stubStorage } from "../storage/storage-stub";

let stored: Map<string, string>;

beforeEach(() => void (stored = stubStorage("localStorage")));
afterEach(() => void vi.unstubAllGlobals());

test("sound is on by default, and the preference is stored", () => {
  expect(browserSoundPreference.load()).toEqual({ on: true, volume: 0.8 });
  browserSoundPreference.save({ on: false, volume: 0.25 });
  expect(browserSoundPreference.load()).toEqual({ on: false, volume: 0.25 });
});

test.each(["{", "null", '"loud"', '{"on":"yes","volume":3}', '{"volume":-1}', '{"volume":null}'])(
  "invalid content gives the default: %s",
  (content) => {
    stored.set("bunraku.sound", content);
    expect(browserSoundPreference.load()).toEqual({ on: true, volume: 0.8 });
  },
);

test("forbidden storage is not an error", () => {
  forbidStorage("localStorage");
  expect(browserSoundPreference.load().on).toBe(true);
  expect(() => browserSoundPreference.save({ on: false, volume: 1 })).not.toThrow();
});
