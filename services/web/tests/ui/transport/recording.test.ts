import { describe, expect, test } from "vitest";
import type { Motion } from "../../../src/client/api";
import { ProblemError } from "../../../src/client/problem";
import type { ToastAction } from "../../../src/ui/notification/toast";
import { createRecordAction, type RecordSession, recordingName } from "../../../src/ui/transport/recording";

const MOTION = { id: "m2", name: "Kept dance" } as unknown as Motion;

type SessionOnStage = { id: string; motionName: string } | null;

function createAction(record: RecordSession, session: SessionOnStage = { id: "s1", motionName: "Sanbaso" }) {
  const calls: string[] = [];
  const actions: ToastAction[] = [];
  const run = createRecordAction({
    record,
    puppeteer: "Aiko",
    toast: (message, ...toastActions) => {
      calls.push(message);
      actions.push(...toastActions);
    },
    session: () => session,
    onRecorded: async ({ id }) => void calls.push(`recorded ${id}`),
    play: (id) => calls.push(`play ${id}`),
    showDownloads: (id) => calls.push(`download ${id}`),
  });
  return { run, calls, actions };
}

describe("record action", () => {
  test("records the session under a new name, and offers the new motion", async () => {
    const requests: unknown[] = [];
    const { run, calls, actions } = createAction(async (...request) => (requests.push(request), MOTION));
    await run();
    expect(requests).toEqual([["s1", "Sanbaso, as Aiko pulled it"]]);
    expect(calls).toEqual(["recorded m2", "Kept: Kept dance"]);
    for (const { run: act } of actions) act();
    expect(calls.slice(2)).toEqual(["play m2", "download m2"]);
  });

  test("shows the server's rejection", async () => {
    const { run, calls } = createAction(() =>
      Promise.reject(new ProblemError(409, "Nothing to keep", "nobody has pulled yet")),
    );
    await run();
    expect(calls).toEqual(["Nothing to keep: nobody has pulled yet"]);
  });

  test("does nothing without a session, and rethrows other errors", async () => {
    const { run, calls } = createAction(async () => MOTION, null);
    await run();
    expect(calls).toEqual([]);
    await expect(createAction(() => Promise.reject(new TypeError("ours"))).run()).rejects.toThrow("ours");
  });
});

test("recording of a recording has one name suffix", () => {
  expect(recordingName(recordingName("Sanbaso", "Aiko"), "Mateo")).toBe("Sanbaso, as Mateo pulled it");
  expect(recordingName("", "Mateo")).toBe("A dance, as Mateo pulled it");
});
