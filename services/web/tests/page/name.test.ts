import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { ownName } from "../../src/page/name";
import { forbidStorage, stubStorage } from "../storage/stubs";

const nothing = new URLSearchParams();

beforeEach(() => void stubStorage("localStorage"));
afterEach(() => void vi.unstubAllGlobals());

test("a name is picked once, and kept", () => {
  const name = ownName(nothing, 0);
  expect(name).not.toBe("");
  expect(ownName(new URLSearchParams("name=+"), 0.9999)).toBe(name);
});

test("the address's is taken without what is about it, no longer than a tag has room for, and kept", () => {
  expect(ownName(new URLSearchParams({ name: ` ${"Aiko".repeat(20)} ` }), 0)).toBe("Aiko".repeat(10));
  expect(ownName(nothing, 0)).toBe("Aiko".repeat(10));
});

test("where storage is forbidden there is one all the same", () => {
  forbidStorage("localStorage");
  expect(ownName(new URLSearchParams("name=Mateo"), 0)).toBe("Mateo");
  expect(ownName(nothing, 0)).not.toBe(ownName(nothing, 0.9999));
});
