import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { resolveDisplayName } from "../../src/ui/display-name";
import { forbidStorage, stubStorage } from "../storage/storage-stub";

const nothing = new URLSearchParams();

beforeEach(() => void stubStorage("localStorage"));
afterEach(() => void vi.unstubAllGlobals());

test("a name is picked once, and kept", () => {
  const name = resolveDisplayName(nothing, 0);
  expect(name).not.toBe("");
  expect(resolveDisplayName(new URLSearchParams("name=+"), 0.9999)).toBe(name);
});

test("the address's is taken without what is about it, no longer than a tag has room for, and kept", () => {
  expect(resolveDisplayName(new URLSearchParams({ name: ` ${"Aiko".repeat(20)} ` }), 0)).toBe("Aiko".repeat(10));
  expect(resolveDisplayName(nothing, 0)).toBe("Aiko".repeat(10));
});

test("where storage is forbidden there is one all the same", () => {
  forbidStorage("localStorage");
  expect(resolveDisplayName(new URLSearchParams("name=Mateo"), 0)).toBe("Mateo");
  expect(resolveDisplayName(nothing, 0)).not.toBe(resolveDisplayName(nothing, 0.9999));
});
