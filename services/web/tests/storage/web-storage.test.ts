import { afterEach, expect, test, vi } from "vitest";
import { browserStorage, tabStorage, WebStorage } from "../../src/storage/web-storage";
import { forbidStorage, stubStorage } from "./storage-stub";

afterEach(() => void vi.unstubAllGlobals());

test.each([
  ["localStorage", browserStorage],
  ["sessionStorage", tabStorage],
] as const)("text in %s is found until it is removed", (name, store) => {
  const stored = stubStorage(name);
  expect(store.get("a")).toBeNull();
  store.put("a", "one");
  store.put("a", "two");
  expect([store.get("a"), ...stored]).toEqual(["two", ["a", "two"]]);
  store.remove("a");
  expect([store.get("a"), stored.size]).toEqual([null, 0]);
});

test.each([{ on: true }, [1, null], "text", 0, null])("JSON value is returned unchanged: %j", (value) => {
  stubStorage("localStorage");
  browserStorage.putJson("a", value);
  expect(browserStorage.getJson("a")).toEqual(value);
});

test.each([undefined, "", "{", "text"])("invalid JSON is read as null: %j", (content) => {
  const stored = stubStorage("localStorage");
  if (content !== undefined) stored.set("a", content);
  expect(browserStorage.getJson("a")).toBeNull();
});

test("forbidden storage finds nothing and throws nothing", () => {
  forbidStorage("localStorage");
  browserStorage.put("a", "one");
  browserStorage.putJson("a", 1);
  browserStorage.remove("a");
  expect([browserStorage.get("a"), browserStorage.getJson("a")]).toEqual([null, null]);
});

test("missing storage finds nothing and throws nothing", () => {
  const store = new WebStorage(() => {
    throw new DOMException("Access is denied for this document.", "SecurityError");
  });
  store.put("a", "one");
  store.remove("a");
  expect(store.get("a")).toBeNull();
});
