import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { StartupSequence } from "../../src/app/startup";

beforeEach(() => void vi.useFakeTimers());
afterEach(() => void vi.useRealTimers());

function begin(): { arriving: StartupSequence; told: string[]; veil: () => string | undefined } {
  const root = { dataset: {} as DOMStringMap } as HTMLElement;
  const arriving = new StartupSequence(root);
  const told: string[] = [];
  arriving.runWhenFinished(() => void told.push("sound"));
  return { arriving, told, veil: () => root.dataset["arriving"] };
}

test("a page whose stage is ready at once shows itself with the puppet, and what waited is done then, once", () => {
  const { arriving, told, veil } = begin();
  expect(veil()).toBe("veiled");
  arriving.onStageReady();
  vi.advanceTimersByTime(1_000);
  expect([veil(), told]).toEqual(["veiled", []]);
  arriving.finish();
  expect([veil(), told]).toEqual([undefined, ["sound"]]);
  arriving.finish();
  vi.advanceTimersByTime(10_000);
  expect([veil(), told]).toEqual([undefined, ["sound"]]);
});

test("a page whose stage is on its way over a slow line shows itself, and all else waits on", () => {
  const { arriving, told, veil } = begin();
  vi.advanceTimersByTime(2_500);
  expect([veil(), told]).toEqual(["", []]);
  vi.advanceTimersByTime(60_000);
  expect([veil(), told]).toEqual(["", []]);
  arriving.onStageReady();
  arriving.finish();
  expect([veil(), told]).toEqual([undefined, ["sound"]]);
});

test("nothing waits for long where nobody dances", () => {
  const { arriving, told, veil } = begin();
  arriving.onStageReady();
  vi.advanceTimersByTime(2_000);
  expect([veil(), told]).toEqual([undefined, ["sound"]]);
});

test("once the puppet is there nothing has to wait", () => {
  const { arriving, told } = begin();
  arriving.finish();
  arriving.runWhenFinished(() => void told.push("later"));
  expect(told).toEqual(["sound", "later"]);
});
