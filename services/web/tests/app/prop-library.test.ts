import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { PropLibrary } from "../../src/app/prop-library";
import { pageAccess } from "../../src/client/access";
import { FakeRequest } from "../client/fake-request";
import { STORED_ID } from "../prop-model-file";

const OTHER_ID = STORED_ID.replace("a", "b");
const sword = { id: STORED_ID, name: "sword", guessed: [] as string[] };
const file = new File(["glTF"], "sword.glb");
const problem = (status: number) => Response.json({ title: "No", detail: "not now" }, { status });

let library: PropLibrary;
let toasts: string[];
let brought: string[];
let requests: string[];
let answers: Record<string, () => Response>;
let isConfirmed: boolean;
let hasRoom: boolean;

beforeEach(() => {
  [toasts, brought, requests, isConfirmed, hasRoom] = [[], [], [], true, true];
  answers = { "GET /v1/props?limit=24": () => Response.json({ items: [sword], next: null }) };
  vi.stubGlobal("fetch", (url: string, { method }: RequestInit) => {
    const request = `${method} ${url}`;
    requests.push(request);
    return Promise.resolve(answers[request]?.() ?? problem(404));
  });
  vi.stubGlobal("XMLHttpRequest", FakeRequest);
  library = new PropLibrary({
    toast: (message) => void toasts.push(message),
    bring: (kind) => {
      brought.push(kind);
      return Promise.resolve(hasRoom);
    },
    confirm: () => isConfirmed,
  });
});
afterEach(() => {
  vi.unstubAllGlobals();
  pageAccess.setToken(null);
});

test("nothing is requested before the list is shown", () => {
  expect([requests, library.items]).toEqual([[], []]);
});

test("the newest props are listed, and their kinds have names", async () => {
  let changes = 0;
  library.onChange = () => changes++;
  await library.refresh();
  expect(library.items).toEqual([sword]);
  expect(changes).toBe(1);
  expect(library.nameOf(STORED_ID)).toBe("sword");
  expect(library.nameOf("lantern")).toBeNull();
  expect(requests).toEqual(["GET /v1/props?limit=24"]);
});

test("the name of a prop that is not listed is asked for once, and again with the next list", async () => {
  let changes = 0;
  library.onChange = () => changes++;
  for (let times = 0; times < 2; times++) expect(library.nameOf(OTHER_ID)).toBeNull();
  expect(requests).toEqual([`GET /v1/props/${OTHER_ID}`]);
  answers[`GET /v1/props/${OTHER_ID}`] = () => Response.json({ id: OTHER_ID, name: "drum" });
  await library.refresh();
  expect(library.nameOf(OTHER_ID)).toBeNull();
  await expect.poll(() => library.nameOf(OTHER_ID)).toBe("drum");
  expect(changes).toBe(2);
});

test("a list that is not sent is reported, but not one that a link may not read", async () => {
  await library.refresh();
  answers["GET /v1/props?limit=24"] = () => problem(403);
  await library.refresh();
  expect(toasts).toEqual([]);
  answers["GET /v1/props?limit=24"] = () => problem(503);
  await library.refresh();
  expect(toasts).toEqual(["No: not now"]);
  expect(library.items).toEqual([sword]);
});

test("files are stored one after the other, with their progress, and brought on the stage", async () => {
  const shares: (number | null)[] = [];
  library.onChange = () => shares.push(library.uploadShare);
  const uploaded = library.upload([file, file]);
  await expect.poll(() => library.uploadShare).toBe(0);
  const first = FakeRequest.last;
  expect(first.arguments[1]).toBe("/v1/props?filename=sword.glb");
  first.upload.dispatchEvent(Object.assign(new Event("progress"), { loaded: 1, total: 2 }));
  first.respond(201, JSON.stringify({ ...sword, guessed: ["The file seems to be in centimetres."] }));
  await expect.poll(() => FakeRequest.last === first).toBe(false);
  FakeRequest.last.respond(200, JSON.stringify(sword));
  await uploaded;
  expect(brought).toEqual([STORED_ID, STORED_ID]);
  expect(toasts).toEqual([
    "Uploading sword.glb",
    "sword is on the stage. The file seems to be in centimetres.",
    "Uploading sword.glb",
    "sword is on the stage.",
  ]);
  expect(shares).toEqual([0, 0.5, null, null, 0, null, null]);
  expect(library.items).toEqual([sword]);
});

test("a file that is refused or too large does not stop the next", async () => {
  const large = Object.defineProperty(new File([], "castle.glb"), "size", { value: 17e6 });
  const uploaded = library.upload([large, file, file]);
  await expect.poll(() => library.uploadShare).toBe(0);
  const refused = FakeRequest.last;
  refused.respond(422, '{"title": "Not a prop", "detail": "it has no mesh", "hint": "export it with one"}');
  await expect.poll(() => FakeRequest.last === refused).toBe(false);
  hasRoom = false;
  FakeRequest.last.respond(201, JSON.stringify(sword));
  await uploaded;
  expect(toasts).toEqual([
    "castle.glb is too large: a prop has at most 16 MB",
    "Uploading sword.glb",
    "Not a prop: it has no mesh; export it with one",
    "Uploading sword.glb",
  ]);
  expect(library.uploadShare).toBeNull();
});

test("a prop is deleted once that is confirmed, and the list is fetched again", async () => {
  await library.refresh();
  isConfirmed = false;
  await library.remove(library.items[0]);
  expect(requests).toHaveLength(1);
  isConfirmed = true;
  answers["GET /v1/props?limit=24"] = () => Response.json({ items: [], next: null });
  answers[`DELETE /v1/props/${STORED_ID}`] = () => new Response(null, { status: 204 });
  await library.remove(library.items[0]);
  expect(requests.slice(1)).toEqual([`DELETE /v1/props/${STORED_ID}`, "GET /v1/props?limit=24"]);
  expect(library.items).toEqual([]);
});

test("a prop that someone else has deleted is no problem, another answer is", async () => {
  await library.remove(sword as never);
  expect(toasts).toEqual([]);
  answers[`DELETE /v1/props/${STORED_ID}`] = () => problem(503);
  await library.remove(sword as never);
  expect(toasts).toEqual(["No: not now"]);
});

test("only a page that may upload changes stored props", () => {
  expect(library.canChange).toBe(true);
  pageAccess.setToken(`a.${btoa(JSON.stringify({ role: "control" }))}.b`);
  expect(new PropLibrary({} as never).canChange).toBe(false);
});
