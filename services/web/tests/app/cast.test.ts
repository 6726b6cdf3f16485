import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { addMotionToStage } from "../../src/app/cast";
import type { Playback } from "../../src/app/playback";
import type { MotionItem } from "../../src/ui/library/library-panel";
import { MotionList } from "../../src/ui/library/motion-list";

const PIECE: MotionItem = { id: "b", name: "Bow", detail: "", seconds: 3, performers: 1 };

let asked: [string, unknown][];
let edits: unknown[];
let problems: (string | null)[][];
let answer: () => Response;

beforeEach(() => {
  [asked, edits, problems] = [[], [], []];
  vi.stubGlobal("fetch", (path: string, { method, body }: RequestInit) => {
    asked.push([`${method} ${path}`, body ? JSON.parse(String(body)) : null]);
    return Promise.resolve(
      method === "POST"
        ? answer()
        : Response.json({
            items: [{ id: "ab", name: "Both", filename: "", fps: 60, duration: 3, performers: 2 }],
            next: null,
          }),
    );
  });
});
afterEach(() => void vi.unstubAllGlobals());

/** Adds a piece to a stage of so many; the library as it is then. */
async function add(piece: MotionItem, performers: number): Promise<MotionList> {
  const pieces = new MotionList();
  const viewer = { motion: "a", performers: Array(performers).fill(null) };
  const room = { viewer, position: () => 1.25, edit: (edit: unknown) => edits.push(edit) };
  await addMotionToStage(piece, room as unknown as Playback, pieces, { problem: (...told) => problems.push(told) });
  return pieces;
}

test("all go to the new motion, where the dance is, and the library has it", async () => {
  answer = () => Response.json({ id: "ab" }, { status: 201 });
  const pieces = await add(PIECE, 1);
  expect(asked.map(([what]) => what)).toEqual(["POST /v1/motions/a/performers", "GET /v1/motions"]);
  expect(asked[0][1]).toEqual({ motions: ["b"] });
  expect(edits).toEqual([{ motion: "ab", position: 1_250_000 }]);
  expect(pieces.find("ab")?.detail).toBe("60 Hz, 2 dancers");
});

test("four are the most: more are not asked for, and it is said", async () => {
  await add({ ...PIECE, performers: 2 }, 3);
  expect([asked, edits]).toEqual([[], []]);
  expect(problems).toEqual([
    ["Bow", "There is no more room on the stage", "4 dancers are the most that a stage has", null],
  ]);
});

test("what the server refuses is told in its words, and the stage stays as it is", async () => {
  answer = () =>
    Response.json(
      { title: "No such motion", detail: "there is no motion b", hint: "look at the list" },
      { status: 404 },
    );
  await add(PIECE, 1);
  expect(edits).toEqual([]);
  expect(problems).toEqual([["Bow", "No such motion", "there is no motion b", "look at the list"]]);
});
