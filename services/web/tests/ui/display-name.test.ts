import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { resolveDisplayName } from "../../src/ui/display-name";
import { forbidStorage, stubStorage } from "../storage/storage-stub";

const emptyQuery = new URLSearchParams();

beforeEach(() => void stubStorage("localStorage"));
afterEach(() => void vi.unstubAllGlobals());

test("default name is picked once and stored", () => {
  const name = resolveDisplayName(emptyQuery, 0);
  expect(name).not.toBe("");
  expect(resolveDisplayName(new URLSearchParams("name=+"), 0.9999)).toBe(name);
});

test("name in the address is trimmed, shortened and stored", () => {
  expect(resolveDisplayName(new URLSearchParams({ name: ` ${"Aiko".repeat(20)} ` }), 0)).toBe("Aiko".repeat(10));
  expect(resolveDisplayName(emptyQuery, 0)).toBe("Aiko".repeat(10));
});

test("name is resolved without storage", () => {
  forbidStorage("localStorage");
  expect(resolveDisplayName(new URLSearchParams("name=Mateo"), 0)).toBe("Mateo");
  expect(resolveDisplayName(emptyQuery, 0)).not.toBe(resolveDisplayName(emptyQuery, 0.9999));
});
