import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { createPropActions, moveNearestProp, type PropContext } from "../../src/app/prop-actions";
import { RemotePlayback } from "../../src/app/remote-playback";
import type { PropRefusalReason } from "../../src/engine/prop-request";
import type { Presence, PropPresence } from "../../src/wire/messages";
import { FakeRequest } from "../client/fake-request";
import { STORED_ID } from "../prop-model-file";

let playback: RemotePlayback | null;
let requests: unknown[];
let toasts: string[];
let puts: [number, number | null][];
let answer: () => Promise<PropRefusalReason | null>;
let respond: () => Response;

beforeEach(() => {
  playback = new RemotePlayback(1, "s 1", "sessions", () => undefined);
  playback.performerCount = 2;
  [requests, toasts, puts] = [[], [], []];
  answer = () => Promise.resolve(null);
  respond = () => Response.json({});
  vi.stubGlobal("fetch", (path: string, { method, body }: RequestInit) => {
    requests.push([`${method} ${path}`, body === undefined ? null : JSON.parse(String(body))]);
    return Promise.resolve(respond());
  });
});
afterEach(() => void vi.unstubAllGlobals());

const context = (): PropContext => ({
  toast: (message) => void toasts.push(message),
  current: playback,
  putProp: (prop, limb) => {
    puts.push([prop, limb]);
    return answer();
  },
  moveProp: async () => ({ limb: 4, refusal: await answer() }),
});
const actions = createPropActions(context);

/** Set the presence: numbers of props, and the holder of the second performer's left hand. */
function show(numbers: number[], holder: string | null = null): void {
  const props = numbers.map((prop): PropPresence => ({ prop, kind: "fan", limb: null, place: [0, 0, 0] }));
  const limbs = Array.from({ length: 8 }, (_, limb) => (limb === 4 ? holder : null));
  const presence: Presence = {
    name: "Presence",
    viewers: 1,
    puppeteers: [{ id: "a", name: "Aiko", colour: 1 }],
    limbs,
    asks: [],
    live: null,
    bonds: null,
    crowd: null,
    props,
  };
  playback?.apply({ event: "presence", presence });
}

/** Run what waits for settled promises. */
const handleAll = () => new Promise((resolve) => setImmediate(resolve));

test("a new prop takes the lowest free number of the session", async () => {
  show([0, 1, 3]);
  createPropActions(context).add("umbrella");
  await expect.poll(() => requests).toEqual([["PATCH /v1/sessions/s%201", { props: { "2": "umbrella" } }]]);
});

test("props that are added at once have numbers of their own, before the session tells them", async () => {
  const present: { prop: number }[] = [];
  respond = () => {
    const [[, { props }]] = requests.slice(-1) as [[string, { props: object }]];
    present.push(...Object.keys(props).map((prop) => ({ prop: Number(prop) })));
    return Response.json({ props: present });
  };
  const { add } = createPropActions(context);
  for (const kind of ["fan", "ball", "branch"] as const) add(kind);
  await expect
    .poll(() => requests.map((request) => (request as [string, { props: object }])[1].props))
    .toEqual([{ "0": "fan" }, { "1": "ball" }, { "2": "branch" }]);
});

test("a number that was taken meanwhile is used again if there is no other", async () => {
  respond = () => Response.json({ props: [0, 1, 2, 3, 4, 5, 6, 7].map((prop) => ({ prop })) });
  const { add } = createPropActions(context);
  add("fan");
  add("ball");
  await expect.poll(() => requests).toHaveLength(2);
});

test("without a free number, or without a session, nothing is sent", async () => {
  const { add, remove } = createPropActions(context);
  show([0, 1, 2, 3, 4, 5, 6, 7]);
  add("ball");
  await handleAll();
  playback = null;
  add("ball");
  remove(1);
  await handleAll();
  expect(requests).toEqual([]);
  expect(toasts).toEqual(["There is room for 8 props"]);
});

test("the stored props are loaded once, and bring props on the stage", async () => {
  show([0]);
  const { stored } = createPropActions(context);
  const props = await stored();
  expect(await stored()).toBe(props);
  expect(requests).toEqual([]);
  vi.stubGlobal("XMLHttpRequest", FakeRequest);
  const uploaded = props.upload([new File([], "sword.glb")]);
  await expect.poll(() => props.uploadShare).toBe(0);
  respond = () => Response.json({ items: [] });
  FakeRequest.last.respond(201, JSON.stringify({ id: STORED_ID, name: "sword", guessed: [] }));
  await uploaded;
  expect(requests[0]).toEqual(["PATCH /v1/sessions/s%201", { props: { "1": STORED_ID } }]);
  expect(toasts).toEqual(["Uploading sword.glb", "sword is on the stage."]);
});

test("a prop is removed by its number, and a rejection is shown", async () => {
  respond = () => Response.json({ title: "Too many requests", detail: "Wait a moment" }, { status: 429 });
  actions.remove(3);
  expect(requests).toEqual([["PATCH /v1/sessions/s%201", { props: { "3": null } }]]);
  await expect.poll(() => toasts).toEqual(["Too many requests: Wait a moment"]);
});

test("a prop that was put says nothing", async () => {
  await actions.put(2, 5);
  await actions.put(2, null);
  expect(puts).toEqual([
    [2, 5],
    [2, null],
  ]);
  expect(toasts).toEqual([]);
});

test.each([
  ["held", 4, "a", "Aiko holds the left hand of dancer 2"],
  ["held", 4, null, "Someone else holds the hand with this prop"],
  ["held", null, null, "Someone else holds the hand with this prop"],
  ["full", 1, null, "The right hand of dancer 1 has another prop"],
  ["unknown", 1, null, "This prop is no longer on the stage"],
  ["no answer", 1, null, "Not connected. Try again when the connection is back"],
] as const)("the refusal %s of %s, held by %s, is explained", async (reason, limb, holder, text) => {
  show([0], holder);
  answer = () => Promise.resolve(reason);
  await actions.put(0, limb);
  expect(toasts).toEqual([text]);
});

test("the key says what keeps a prop where it is, and is without effect on a motion", async () => {
  await moveNearestProp(context());
  answer = () => Promise.resolve("none near");
  await moveNearestProp(context());
  answer = () => Promise.reject(new Error("no engine"));
  await moveNearestProp(context());
  playback = null;
  await moveNearestProp(context());
  expect(toasts).toEqual([
    "Bring a hand that you hold near a prop",
    "Not connected. Try again when the connection is back",
  ]);
});

test("a failed engine is like no connection", async () => {
  answer = () => Promise.reject(new Error("no engine"));
  await actions.put(0, 1);
  expect(toasts).toEqual(["Not connected. Try again when the connection is back"]);
});
