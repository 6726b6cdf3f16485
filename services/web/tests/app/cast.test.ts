import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { addMotionToStage } from "../../src/app/cast";
import type { RemotePlayback } from "../../src/app/remote-playback";
import type { MotionItem } from "../../src/ui/library/motion-item";
import { MotionList } from "../../src/ui/library/motion-list";

const ITEM: MotionItem = { id: "b", name: "Bow", detail: "", seconds: 3, performers: 1, tags: [] };

let requests: [string, unknown][];
let edits: unknown[];
let problems: (string | null)[][];
let respond: () => Response;

beforeEach(() => {
  [requests, edits, problems] = [[], [], []];
  vi.stubGlobal("fetch", (path: string, { method, body }: RequestInit) => {
    requests.push([`${method} ${path}`, body ? JSON.parse(String(body)) : null]);
    return Promise.resolve(
      method === "POST"
        ? respond()
        : Response.json({
            items: [{ id: "ab", name: "Both", filename: "", fps: 60, duration: 3, performers: 2 }],
            next: null,
          }),
    );
  });
});
afterEach(() => void vi.unstubAllGlobals());

/** Add a motion to a stage with this many performers, and return the motion list. */
async function addToStage(item: MotionItem, performers: number): Promise<MotionList> {
  const motions = new MotionList();
  const playback = {
    motion: "a",
    performerCount: performers,
    position: 1.25,
    edit: (edit: unknown) => edits.push(edit),
  };
  await addMotionToStage(item, playback as unknown as RemotePlayback, motions, {
    problem: (...problem) => problems.push(problem),
  });
  return motions;
}

test("session switches to the combined motion at the same position", async () => {
  respond = () => Response.json({ id: "ab" }, { status: 201 });
  const motions = await addToStage(ITEM, 1);
  expect(requests.map(([request]) => request)).toEqual(["POST /v1/motions/a/performers", "GET /v1/motions"]);
  expect(requests[0][1]).toEqual({ motions: ["b"] });
  expect(edits).toEqual([{ motion: "ab", position: 1_250_000 }]);
  expect(motions.find("ab")?.detail).toBe("60 Hz, 2 dancers");
});

test("adding more than four performers shows an error and sends no request", async () => {
  await addToStage({ ...ITEM, performers: 2 }, 3);
  expect([requests, edits]).toEqual([[], []]);
  expect(problems).toEqual([["Bow", "The stage is full", "a stage holds at most 4 dancers", null]]);
});

test("rejection by the server is shown and leaves the stage unchanged", async () => {
  respond = () =>
    Response.json(
      { title: "No such motion", detail: "there is no motion b", hint: "look at the list" },
      { status: 404 },
    );
  await addToStage(ITEM, 1);
  expect(edits).toEqual([]);
  expect(problems).toEqual([["Bow", "No such motion", "there is no motion b", "look at the list"]]);
});
