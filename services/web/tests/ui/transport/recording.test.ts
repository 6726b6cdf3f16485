import { describe, expect, test } from "vitest";
import type { Motion } from "../../../src/client/api";
import { ProblemError } from "../../../src/client/problem";
import type { ToastAction } from "../../../src/ui/notification/toast";
import { createRecordAction, type RecordSession, recordingName } from "../../../src/ui/transport/recording";

const MOTION = { id: "m2", name: "Kept dance" } as unknown as Motion;

function page(keep: RecordSession, session: { id: string; piece: string } | null = { id: "s1", piece: "Sanbaso" }) {
  const told: string[] = [];
  const actions: ToastAction[] = [];
  const run = createRecordAction({
    record: keep,
    puppeteer: "Aiko",
    toast: (message, ...offered) => {
      told.push(message);
      actions.push(...offered);
    },
    session: () => session,
    onRecorded: async ({ id }) => void told.push(`kept ${id}`),
    play: (id) => told.push(`choose ${id}`),
    showDownloads: (id) => told.push(`download ${id}`),
  });
  return { run, told, actions };
}

describe("keep this", () => {
  test("keeps the session under a name of its own, and offers the new dance", async () => {
    const asked: unknown[] = [];
    const { run, told, actions } = page(async (...of) => (asked.push(of), MOTION));
    await run();
    expect(asked).toEqual([["s1", "Sanbaso, as Aiko pulled it"]]);
    expect(told).toEqual(["kept m2", "Kept: Kept dance"]);
    for (const { run: act } of actions) act();
    expect(told.slice(2)).toEqual(["choose m2", "download m2"]);
  });

  test("says what the server would not do", async () => {
    const { run, told } = page(() => Promise.reject(new ProblemError(409, "Nothing to keep", "nobody has pulled yet")));
    await run();
    expect(told).toEqual(["Nothing to keep: nobody has pulled yet"]);
  });

  test("does nothing without a session, and hides no other error", async () => {
    const { run, told } = page(async () => MOTION, null);
    await run();
    expect(told).toEqual([]);
    await expect(page(() => Promise.reject(new TypeError("ours"))).run()).rejects.toThrow("ours");
  });
});

test("what is kept of what was kept is named after the dance once", () => {
  expect(recordingName(recordingName("Sanbaso", "Aiko"), "Mateo")).toBe("Sanbaso, as Mateo pulled it");
  expect(recordingName("", "Mateo")).toBe("A dance, as Mateo pulled it");
});
