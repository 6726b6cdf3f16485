import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { bind, DEFAULT_MAPPING } from "../../src/input/mapping";
import { loadMapping, saveMapping } from "../../src/input/mapping-store";
import { forbidStorage, stubStorage } from "../storage/storage-stub";

let storage: Map<string, string>;

beforeEach(() => void (storage = stubStorage("localStorage")));
afterEach(() => void vi.unstubAllGlobals());

test("a stored mapping is loaded; the default is stored as nothing", () => {
  const custom = { ...bind(DEFAULT_MAPPING, "KeyZ", "keep"), deadZone: 0.3 };
  expect(loadMapping()).toBe(DEFAULT_MAPPING);
  saveMapping(custom);
  expect(loadMapping()).toEqual(custom);
  saveMapping(DEFAULT_MAPPING);
  expect([loadMapping(), storage.size]).toEqual([DEFAULT_MAPPING, 0]);
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
])("unreadable content gives the default: %s", (content) => {
  saveMapping(bind(DEFAULT_MAPPING, "KeyZ", "keep"));
  for (const key of storage.keys()) storage.set(key, content);
  expect(loadMapping()).toBe(DEFAULT_MAPPING);
});

test("forbidden storage is not an error", () => {
  forbidStorage("localStorage");
  expect(loadMapping()).toBe(DEFAULT_MAPPING);
  expect(() => saveMapping({ ...DEFAULT_MAPPING })).not.toThrow();
});
