import { afterEach, expect, test, vi } from "vitest";
import { browserStore, Store, tabStore } from "../../src/storage/store";
import { forbidStorage, stubStorage } from "./stubs";

afterEach(() => void vi.unstubAllGlobals());

test.each([["localStorage", browserStore], ["sessionStorage", tabStore]] as const)("what is put in %s is found, until it is removed", (name, store) => {
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
  browserStore.putJson("a", value);
  expect(browserStore.getJson("a")).toEqual(value);
});

test.each([undefined, "", "{", "text"])("what is no JSON is no value: %j", (content) => {
  const kept = stubStorage("localStorage");
  if (content !== undefined) kept.set("a", content);
  expect(browserStore.getJson("a")).toBeNull();
});

test("where its use is refused nothing is found, and nothing fails", () => {
  forbidStorage("localStorage");
  browserStore.put("a", "one");
  browserStore.putJson("a", 1);
  browserStore.remove("a");
  expect([browserStore.get("a"), browserStore.getJson("a")]).toEqual([null, null]);
});

test("where there is not even a storage to name, neither", () => {
  const store = new Store(() => {
    throw new DOMException("Access is denied for this document.", "SecurityError");
  });
  store.put("a", "one");
  store.remove("a");
  expect(store.get("a")).toBeNull();
});
