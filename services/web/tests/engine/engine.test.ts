import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { Engine } from "../../src/engine/engine";
import type { EngineEvent, EngineOptions, PlaybackChange } from "../../src/engine/message";
import { DEFAULT_MAPPING } from "../../src/input/mapping";
import type { StageCanvas } from "../../src/stage/rendering/canvas";
import { FakeWebSocket } from "../client/fake-websocket";
import { description, header, timeline } from "../client/viewer-suite";

const OPTIONS: EngineOptions = {
  server: "http://stage.example",
  token: null,
  language: "en",
  timeOrigin: performance.timeOrigin,
  bestQuality: false,
  view: null,
};
const PEOPLE = [
  { id: "a", name: "Aiko", colour: 0 },
  { id: "m", name: "Mateo", colour: 1 },
];

let engine: Engine;
let events: EngineEvent[];

/** Start an engine on a canvas without graphics. */
function startEngine(options: Partial<EngineOptions> = {}): void {
  const canvas = { getContext: () => null } as unknown as StageCanvas;
  engine = new Engine(canvas, { ...OPTIONS, ...options }, (event) => void events.push(structuredClone(event)));
}

/** Enter a session; return its stream and control sockets. */
function openSession(number = 1, id = "s1"): { stream: FakeWebSocket; control: FakeWebSocket } {
  engine.handle({ type: "open", playback: { number, id, kind: "sessions", name: "Aiko" } });
  const [stream, control] = FakeWebSocket.opened.slice(-2);
  stream.accept();
  control.accept();
  return { stream, control };
}

const eventsOf = <Type extends EngineEvent["type"]>(type: Type) =>
  events.filter((event): event is Extract<EngineEvent, { type: Type }> => event.type === type);
const changes = (): PlaybackChange[] => eventsOf("playback").map(({ change }) => change);

beforeEach(() => {
  FakeWebSocket.install();
  events = [];
  startEngine();
});
afterEach(() => {
  engine.close();
  FakeWebSocket.remove();
});

test("a canvas without graphics is reported, and the session goes on", async () => {
  await engine.start();
  expect(eventsOf("unavailable")).toEqual([{ type: "unavailable", reason: "graphics" }]);
  const { stream } = openSession();
  stream.receive(header(), description(), timeline());
  expect(changes().map(({ event }) => event)).toEqual(["open", "figure", "blocks", "timeline"]);
});

test("the page is sent every change of the playback with its values", () => {
  const { stream, control } = openSession();
  control.receive({ name: "Welcome", id: "a", colour: 0, lead: 100_000 });
  stream.receive(header(), description(), timeline({ loop: true }));
  stream.receive({
    name: "Presence",
    live: null,
    bonds: null,
    crowd: null,
    props: null,
    viewers: 3,
    puppeteers: PEOPLE,
    limbs: [null, "m", null, null],
    asks: [[], [], [], []],
  });
  stream.endWith(1006);
  const [, , figure, , state, presence] = changes();
  expect(changes()[1]).toEqual({ event: "welcome", puppeteer: "a" });
  expect(figure).toMatchObject({ event: "figure", motion: "dance", performerCount: 1, levelCount: 2 });
  expect(figure.event === "figure" && figure.duration).toBeGreaterThan(1);
  expect(state).toMatchObject({ event: "timeline", timeline: { loop: true } });
  expect(presence).toMatchObject({ event: "presence", presence: { viewers: 3 } });
  expect(changes().at(-1)).toMatchObject({ event: "closed", isClosed: false });
  const claims = eventsOf("limbs").map((event) => event.state);
  // Nothing can be taken on a stage that is not there.
  expect(claims.map(({ isReady }) => isReady)).not.toContain(true);
  expect(claims.at(-1)?.limbs[1].holder?.name).toBe("Mateo");
});

test("changes of a playback that was left are not sent", () => {
  const first = openSession(1, "s1");
  const second = openSession(2, "s2");
  events.length = 0;
  first.stream.receive(header());
  first.stream.endWith(1000);
  second.stream.receive(header(), description());
  expect(new Set(eventsOf("playback").map(({ playback }) => playback))).toEqual(new Set([2]));
});

test("a limb that somebody else holds is asked for, with an offer in the toast", () => {
  const { stream, control } = openSession();
  control.receive({ name: "Welcome", id: "a", colour: 0, lead: 100_000 });
  stream.receive(header(), description(), timeline());
  for (const socket of [stream, control])
    socket.receive({
      name: "Presence",
      live: null,
      bonds: null,
      crowd: null,
      props: null,
      viewers: 2,
      puppeteers: PEOPLE,
      limbs: [null, "m", null, null],
      asks: [[], [], [], []],
    });
  engine.handle({ type: "limb", action: "ask", limb: 1 });
  expect(control.messagesOf("Ask")).toEqual([{ name: "Ask", limb: 1, wanted: true }]);
  expect(eventsOf("toast").at(-1)?.message).toBe("You ask Mateo for the right hand");
  engine.handle({ type: "limb", action: "withdraw", limb: 1 });
  expect(control.messagesOf("Ask").at(-1)?.wanted).toBe(false);
});

test("statistics and time follow the playback twice per second, on the page's clock", () => {
  engine.close();
  startEngine({ timeOrigin: performance.timeOrigin - 5_000 });
  const { stream } = openSession();
  vi.advanceTimersByTime(500);
  expect(eventsOf("statistics").at(-1)).toMatchObject({ playback: 1, isConnected: true, time: null });
  stream.receive(header(), description(), timeline());
  vi.advanceTimersByTime(500);
  const { time } = eventsOf("statistics").at(-1)!;
  // The origin of the page's clock is earlier, so its times are larger.
  expect(time?.now).toBeCloseTo(performance.now() + 5_000, 3);
});

test("a key hint follows the mapping of the page", () => {
  const { KeyG: _, ...bindings } = DEFAULT_MAPPING.bindings;
  engine.handle({ type: "set", settings: { mapping: { ...DEFAULT_MAPPING, bindings: { KeyZ: ["give"] } } } });
  expect(eventsOf("limbs").at(-1)?.state.giveKey).toBe("Z");
  engine.handle({ type: "set", settings: { mapping: { ...DEFAULT_MAPPING, bindings: {} } } });
  expect(eventsOf("limbs").at(-1)?.state.giveKey).toBeNull();
  expect(Object.keys(bindings).length).toBeGreaterThan(0);
});

test("requests that cannot be fulfilled fail with their reason", async () => {
  engine.handle({ type: "request", id: 1, request: { kind: "picture" } });
  engine.handle({ type: "request", id: 2, request: { kind: "camera keyframes" } });
  const file = new File(["solid cube"], "cube.glb");
  engine.handle({ type: "request", id: 3, request: { kind: "load avatar", performer: 0, file } });
  vi.useRealTimers();
  await expect.poll(() => eventsOf("response").length).toBe(3);
  const responses = new Map(eventsOf("response").map((event) => [event.id, event]));
  expect(responses.get(1)?.failure).toMatchObject({ known: null, message: expect.stringContaining("no stage") });
  expect(responses.get(2)?.result).toEqual([]);
  expect(responses.get(3)?.failure?.known?.title).toBeTruthy();
});

test("edits that the server rejects are reported", async () => {
  vi.stubGlobal("fetch", async () => new Response('{"title": "No", "detail": "not now"}', { status: 409 }));
  openSession();
  engine.handle({ type: "edit", change: { playing: false } });
  vi.useRealTimers();
  await expect.poll(() => eventsOf("edit failed").length).toBe(1);
  expect(eventsOf("edit failed")[0].problem).toEqual({ title: "No", detail: "not now" });
});

test("the state of the limbs is sent when it changes, and with a mapping, whose keys the page shows", () => {
  const { stream, control } = openSession();
  control.receive({ name: "Welcome", id: "a", colour: 0, lead: 100_000 });
  stream.receive(header(), description(), timeline());
  const receivePresence = (viewers: number, holder: string | null) =>
    stream.receive({
      name: "Presence",
      live: null,
      bonds: null,
      crowd: null,
      props: null,
      viewers,
      puppeteers: PEOPLE,
      limbs: [null, holder, null, null],
      asks: [[], [], [], []],
    });
  receivePresence(2, "m");
  events.length = 0;
  receivePresence(3, "m");
  expect(eventsOf("limbs")).toEqual([]);
  receivePresence(3, null);
  engine.handle({ type: "set", settings: { mapping: DEFAULT_MAPPING } });
  expect(eventsOf("limbs").map(({ state }) => state.limbs[1].holder)).toEqual([null, null]);
});

test("a rejected token is reported, and limbs are not offered to viewers", async () => {
  const body = btoa(JSON.stringify({ role: "view" }));
  vi.stubGlobal("fetch", async () => new Response('{"title": "Expired", "detail": "the link"}', { status: 401 }));
  engine.close();
  startEngine({ token: `x.${body}.x` });
  engine.handle({ type: "open", playback: { number: 1, id: "s1", kind: "sessions", name: "" } });
  vi.useRealTimers();
  await expect.poll(() => eventsOf("unauthorized").length).toBeGreaterThan(0);
  expect(eventsOf("unauthorized")[0]).toMatchObject({ title: "Expired", detail: "the link" });
  engine.handle({ type: "limb", action: "toggle", limb: 0 });
  expect(eventsOf("limbs").every(({ state }) => !state.isReady)).toBe(true);
});

test("an immersive session gets no frames without a stage", async () => {
  openSession();
  engine.handle({ type: "immersive", hands: [] });
  engine.handle({ type: "immersive", hands: null });
  await import("../../src/engine/immersive-controller");
  await Promise.resolve();
  expect(eventsOf("immersive")).toEqual([]);
});
