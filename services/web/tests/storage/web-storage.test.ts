import { afterEach, expect, test, vi } from "vitest";
import { browserStorage, tabStorage, WebStorage } from "../../src/storage/web-storage";
import { forbidStorage, stubStorage } from "./storage-stub";

afterEach(() => void vi.unstubAllGlobals());

test.each([
  ["localStorage", browserStorage],
  ["sessionStorage", tabStorage],
] as const)("what is put in %s is found, until it is removed", (name, store) => {
  const kept = stubStorage(name);
  expect(store.get("a")).toBeNull();
  store.put("a", "one");
  store.put("a", "two");
  expect([store.get("a"), ...kept]).toEqual(["two", ["a", "two"]]);
  store.remove("a");
  expect([store.get("a"), kept.size]).toEqual([null, 0]);
});

test.each([{ on: true }, [1, null], "text", 0, null])("a value comes back as it was: %j", (value) => {
  stubStorage("localStorage");
  browserStorage.putJson("a", value);
  expect(browserStorage.getJson("a")).toEqual(value);
});

test.each([undefined, "", "{", "text"])("what is no JSON is no value: %j", (content) => {
  const kept = stubStorage("localStorage");
  if (content !== undefined) kept.set("a", content);
  expect(browserStorage.getJson("a")).toBeNull();
});

test("where its use is refused nothing is found, and nothing fails", () => {
  forbidStorage("localStorage");
  browserStorage.put("a", "one");
  browserStorage.putJson("a", 1);
  browserStorage.remove("a");
  expect([browserStorage.get("a"), browserStorage.getJson("a")]).toEqual([null, null]);
});

test("where there is not even a storage to name, neither", () => {
  const store = new WebStorage(() => {
    throw new DOMException("Access is denied for this document.", "SecurityError");
  });
  store.put("a", "one");
  store.remove("a");
  expect(store.get("a")).toBeNull();
});
