import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { bind, DEFAULT_MAPPING } from "../../src/input/mapping";
import { loadMapping, saveMapping } from "../../src/input/mapping-store";
import { forbidStorage, stubStorage } from "../storage/storage-stub";

let kept: Map<string, string>;

beforeEach(() => void (kept = stubStorage("localStorage")));
afterEach(() => void vi.unstubAllGlobals());

test("what is kept comes back; the default is kept by keeping nothing", () => {
  const mine = { ...bind(DEFAULT_MAPPING, "KeyZ", "keep"), deadZone: 0.3 };
  expect(loadMapping()).toBe(DEFAULT_MAPPING);
  saveMapping(mine);
  expect(loadMapping()).toEqual(mine);
  saveMapping(DEFAULT_MAPPING);
  expect([loadMapping(), kept.size]).toEqual([DEFAULT_MAPPING, 0]);
});

test.each([
  "",
  "{",
  "null",
  "7",
  "[]",
  '"text"',
  "{}",
  '{"version":1}',
  '{"version":1,"mapping":{"bindings":{"KeyW":["fly"]}}}',
  JSON.stringify({ version: 2, mapping: DEFAULT_MAPPING }),
  JSON.stringify(DEFAULT_MAPPING),
])("what cannot be read is the default: %s", (content) => {
  saveMapping(bind(DEFAULT_MAPPING, "KeyZ", "keep"));
  for (const key of kept.keys()) kept.set(key, content);
  expect(loadMapping()).toBe(DEFAULT_MAPPING);
});

test("storage that is forbidden is no error", () => {
  forbidStorage("localStorage");
  expect(loadMapping()).toBe(DEFAULT_MAPPING);
  expect(() => saveMapping({ ...DEFAULT_MAPPING })).not.toThrow();
});
