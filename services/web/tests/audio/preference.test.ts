import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { browserSound } from "../../src/audio/preference";
import { forbidStorage, stubStorage } from "../storage/stubs";

let stored: Map<string, string>;

beforeEach(() => void (stored = stubStorage("localStorage")));
afterEach(() => void vi.unstubAllGlobals());

test("sound is wanted unless told otherwise, and what was told is remembered", () => {
  expect(browserSound.load()).toEqual({ on: true, volume: 0.8 });
  browserSound.save({ on: false, volume: 0.25 });
  expect(browserSound.load()).toEqual({ on: false, volume: 0.25 });
});

test.each(["{", "null", '"loud"', '{"on":"yes","volume":3}', '{"volume":-1}', '{"volume":null}'])("what is none is the default: %s", (content) => {
  stored.set("bunraku.sound", content);
  expect(browserSound.load()).toEqual({ on: true, volume: 0.8 });
});

test("where storage is forbidden it lasts as long as the page", () => {
  forbidStorage("localStorage");
  expect(browserSound.load().on).toBe(true);
  expect(() => browserSound.save({ on: false, volume: 1 })).not.toThrow();
});
