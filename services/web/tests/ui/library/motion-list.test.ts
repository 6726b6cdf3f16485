import { afterEach, expect, test, vi } from "vitest";
import type { Motion } from "../../../src/client/api";
import { MotionList, toMotionItem } from "../../../src/ui/library/motion-list";

const motion: Motion = {
  id: "m1",
  name: "",
  filename: "old_steps.bvh",
  created: "2026-01-01T00:00:00Z",
  duration: 12.5,
  fps: 59.94,
};

test("motion item has a name and a short description", () => {
  expect(toMotionItem(motion)).toEqual({
    id: "m1",
    name: "old steps",
    detail: "BVH, 59.9 Hz",
    seconds: 12.5,
    performers: 1,
    tags: [],
  });
  expect(
    toMotionItem({ ...motion, name: "Old Steps", filename: "", fps: 120, tracks: ["motion", "camera", "audio"] }),
  ).toMatchObject({ name: "Old Steps", detail: "120 Hz, with music" });
  expect(toMotionItem({ ...motion, tracks: ["motion", "light"] }).detail).toBe("BVH, 59.9 Hz");
  expect(toMotionItem({ ...motion, filename: "", performers: 2, tracks: ["motion", "audio", "motion"] })).toMatchObject(
    { detail: "59.9 Hz, 2 dancers, with music", performers: 2 },
  );
});

afterEach(() => void vi.unstubAllGlobals());

/** Serve lists of motions by query, and changed motions. */
function stubLibrary(lists: Record<string, Partial<Motion>[]>): void {
  vi.stubGlobal("fetch", (path: string, { method, body }: RequestInit) => {
    if (method === "GET") return Promise.resolve(Response.json({ items: lists[path.split("?")[1] ?? ""], next: null }));
    if (method === "DELETE") return Promise.resolve(new Response(null, { status: 204 }));
    return Promise.resolve(Response.json({ ...motion, ...(JSON.parse(String(body)) as object) }));
  });
}

test("search finds motions beside the list, and an empty one shows all", async () => {
  const other = { ...motion, id: "m2", tags: ["fan", "slow"] };
  stubLibrary({ "": [other, { ...motion, tags: ["fan"] }], "search=old%20steps&tag=fan": [motion] });
  const list = new MotionList();
  await list.refresh();
  expect([list.items.length, list.found, list.tags]).toEqual([2, null, ["fan", "slow"]]);
  await list.search({ search: "old steps", tag: "fan" });
  expect([list.items.length, list.found?.map(({ id }) => id)]).toEqual([2, ["m1"]]);
  // A refresh searches again.
  stubLibrary({ "": [other], "search=old%20steps&tag=fan": [] });
  await list.refresh();
  expect([list.items.length, list.found]).toEqual([1, []]);
  await list.search({ search: "", tag: "" });
  expect(list.found).toBeNull();
});

test("the latest search counts, in whatever order the server answers", async () => {
  const answers = new Map<string, (response: Response) => void>();
  vi.stubGlobal("fetch", (path: string) => new Promise((resolve) => answers.set(path, resolve)));
  const list = new MotionList();
  const searches = ["a", "ab"].map((search) => list.search({ search, tag: "" }));
  answers.get("/v1/motions?search=ab")?.(Response.json({ items: [motion], next: null }));
  await searches[1];
  answers.get("/v1/motions?search=a")?.(Response.json({ items: [], next: null }));
  await searches[0];
  expect(list.found?.map(({ id }) => id)).toEqual(["m1"]);
});

test("changed and removed motions change in both lists", async () => {
  stubLibrary({ "": [motion], "search=steps": [motion] });
  const list = new MotionList();
  await list.refresh();
  await list.search({ search: "steps", tag: "" });
  await list.label("m1", { name: "Crane", tags: ["x"] });
  for (const motions of [list.items, list.found]) expect(motions?.[0]).toMatchObject({ name: "Crane", tags: ["x"] });
  await list.remove("m1");
  expect([list.items, list.found]).toEqual([[], []]);
});
