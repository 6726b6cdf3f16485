import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { StartupSequence } from "../../src/app/startup";

beforeEach(() => void vi.useFakeTimers());
afterEach(() => void vi.useRealTimers());

function createStartup(): { startup: StartupSequence; calls: string[]; state: () => string | undefined } {
  const root = { dataset: {} as DOMStringMap } as HTMLElement;
  const startup = new StartupSequence(root);
  const calls: string[] = [];
  startup.runWhenFinished(() => void calls.push("sound"));
  void startup.buildDue.then(() => startup.onPageBuilt());
  return { startup, calls, state: () => root.dataset["arriving"] };
}

test("first frame reveals the page and runs waiting callbacks once", () => {
  const { startup, calls, state } = createStartup();
  expect(state()).toBe("veiled");
  startup.onStageReady();
  vi.advanceTimersByTime(1_000);
  expect([state(), calls]).toEqual(["veiled", []]);
  startup.finish();
  expect([state(), calls]).toEqual([undefined, ["sound"]]);
  startup.finish();
  vi.advanceTimersByTime(10_000);
  expect([state(), calls]).toEqual([undefined, ["sound"]]);
});

test("slow stage reveals the page, and callbacks keep waiting for the first frame", async () => {
  const { startup, calls, state } = createStartup();
  await vi.advanceTimersByTimeAsync(2_500);
  expect([state(), calls]).toEqual(["", []]);
  vi.advanceTimersByTime(60_000);
  expect([state(), calls]).toEqual(["", []]);
  startup.onStageReady();
  startup.finish();
  expect([state(), calls]).toEqual([undefined, ["sound"]]);
});

test("callbacks run after a timeout if no motion arrives", () => {
  const { startup, calls, state } = createStartup();
  startup.onStageReady();
  vi.advanceTimersByTime(2_000);
  expect([state(), calls]).toEqual([undefined, ["sound"]]);
});

test("callbacks run at once after the first frame", () => {
  const { startup, calls } = createStartup();
  startup.finish();
  startup.runWhenFinished(() => void calls.push("later"));
  expect(calls).toEqual(["sound", "later"]);
});

function watch(due: Promise<void>): () => boolean {
  let isDue = false;
  void due.then(() => (isDue = true));
  return () => isDue;
}

test("page loads once the scripts of the stage have, or after a timeout", async () => {
  for (const isLoaded of [true, false]) {
    const { startup } = createStartup();
    const isDue = watch(startup.loadDue);
    await vi.advanceTimersByTimeAsync(1_999);
    expect(isDue()).toBe(false);
    if (isLoaded) startup.loadPage();
    await vi.advanceTimersByTimeAsync(isLoaded ? 0 : 1);
    expect(isDue()).toBe(true);
  }
});

test("page is built after the first frame, or once that is late", async () => {
  for (const isDrawn of [true, false]) {
    const { startup } = createStartup();
    const isDue = watch(startup.buildDue);
    startup.loadPage();
    await vi.advanceTimersByTimeAsync(2_499);
    expect(isDue()).toBe(false);
    if (isDrawn) startup.finish();
    await vi.advanceTimersByTimeAsync(isDrawn ? 0 : 1);
    expect(isDue()).toBe(true);
  }
});

test("page that is built late is not revealed before, and the seal stays", async () => {
  const root = { dataset: {} as DOMStringMap } as HTMLElement;
  const startup = new StartupSequence(root);
  await vi.advanceTimersByTimeAsync(10_000);
  expect(root.dataset["arriving"]).toBe("veiled");
  startup.onPageBuilt();
  expect(root.dataset["arriving"]).toBe("");
});
