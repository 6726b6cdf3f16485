import { afterEach, beforeEach, describe, expect, test, vi } from "vitest";
import { Access } from "../../src/client/access";
import { Performer, type PerformerOptions } from "../../src/client/performer";
import { fromRotationVector } from "../../src/motion/rotation";
import { restPose } from "../../src/motion/skeleton";
import { FakeWebSocket } from "./fake-websocket";

const EPOCH_US = 1_774_000_000_000_000;
const SERVER = "https://stage.example";
const DESCRIPTION = {
  id: "p1",
  name: "Aiko",
  fps: 60,
  session: "s1",
  performer: 1,
  motion: "m1",
  input: "/v1/performers/p1/input",
};
const root = [0.25, 0.9, -0.5];
const { rotations } = restPose();
fromRotationVector(rotations, 4 * 12, 0, 0, 1.2);

let requests: { request: string; body: unknown; keepalive: boolean }[];
/** Response to the end of the performance. */
let endResponse: Response;
let events: string[];

beforeEach(() => {
  FakeWebSocket.install();
  requests = [];
  events = [];
  endResponse = new Response(null, { status: 204 });
  vi.stubGlobal("fetch", async (url: string, { method, body, keepalive }: RequestInit) => {
    requests.push({ request: `${method} ${url}`, body: body && JSON.parse(body as string), keepalive: !!keepalive });
    if (method === "DELETE") return endResponse;
    return new Response(JSON.stringify(url.endsWith("/tickets") ? { ticket: "t1" } : DESCRIPTION), { status: 201 });
  });
});
afterEach(() => FakeWebSocket.remove());

/** Answer all pings of the newest connection that are unanswered. */
function answerPings(socket = FakeWebSocket.last, answered = 0): number {
  const pings = socket.messagesOf("Ping");
  for (const { sequence, sent } of pings.slice(answered))
    socket.receive({ name: "Pong", sequence, sent, received: EPOCH_US + sent, answered: EPOCH_US + sent });
  return pings.length;
}

/** Open a performer; return it once its connection is synchronised. */
async function openPerformer(options: PerformerOptions = {}): Promise<Performer> {
  const opening = Performer.open({ access: new Access(SERVER), ...options });
  await vi.advanceTimersByTimeAsync(0);
  FakeWebSocket.last.accept();
  answerPings();
  const performer = await opening;
  for (const name of ["open", "closed", "ended"])
    performer.addEventListener(name, (event) => events.push([name, (event as CustomEvent).detail ?? ""].join(" ")));
  return performer;
}

/** End a performance; the server answers the last ping. */
async function close(performer: Performer): Promise<void> {
  const closing = performer.close();
  answerPings(FakeWebSocket.last, FakeWebSocket.last.messagesOf("Ping").length - 1);
  await closing;
}

test("opens a performer with its fields and connects to its input", async () => {
  const fields = { name: "Aiko", fps: 50, session: "s1", place: [1, 0, 0.5] } as const;
  const figure = { offsets: { l_hip: [0.1, -0.05, 0] }, tips: { skullbase: [0, 0.2, 0] } } as const;
  const performer = await openPerformer({ ...fields, figure });
  expect(requests).toEqual([
    { request: `POST ${SERVER}/v1/performers`, body: { ...fields, figure }, keepalive: false },
  ]);
  expect(FakeWebSocket.last.url).toBe("wss://stage.example/v1/performers/p1/input");
  expect([performer.session, performer.motion, performer.description.performer]).toEqual(["s1", "m1", 1]);
  expect(performer.isOpen).toBe(true);
  await close(performer);
});

test("each connection has a ticket if there is a token", async () => {
  const performer = await openPerformer({ access: new Access(SERVER, "a.b.c") });
  expect(FakeWebSocket.last.url).toBe("wss://stage.example/v1/performers/p1/input?ticket=t1");
  await close(performer);
});

describe("frame", () => {
  test("sends root, rotation vectors and capture time on the reference clock", async () => {
    const performer = await openPerformer();
    const now = performance.now();
    expect(performer.frame(root, rotations, now - 30)).toBe(true);
    expect(performer.frame(root, rotations)).toBe(true);
    const [first, second] = FakeWebSocket.last.messagesOf("Sample");
    expect(first.root).toEqual([0.25, expect.closeTo(0.9), -0.5]);
    expect(Array.from(first.rotations.subarray(36, 39))).toEqual([0, 0, Math.round((1.2 / Math.PI) * 32767)]);
    expect([first.sequence, second.sequence, performer.sent]).toEqual([1, 2, 2]);
    expect(Math.abs(first.sampled - (EPOCH_US + (now - 30) * 1000))).toBeLessThanOrEqual(1);
    expect(Math.abs(second.sampled - (EPOCH_US + performance.now() * 1000))).toBeLessThanOrEqual(1);
    await close(performer);
  });

  test("throws for a pose that the server would reject", async () => {
    const performer = await openPerformer();
    expect(() => performer.frame([0, 101, 0], rotations)).toThrow("expected 3 numbers within 100 m");
    expect(() => performer.frame([0, Number.NaN, 0], rotations)).toThrow(RangeError);
    expect(() => performer.frame([0, 1], rotations)).toThrow(RangeError);
    expect(() => performer.frame(root, rotations.subarray(4))).toThrow("has 68 numbers, expected 72");
    expect(() => performer.frame(root, rotations.slice().fill(Number.NaN))).toThrow(RangeError);
    expect(FakeWebSocket.last.messagesOf("Sample")).toEqual([]);
    await close(performer);
  });
});

describe("connection", () => {
  test("that is lost is made again, and goes on", async () => {
    const performer = await openPerformer();
    FakeWebSocket.last.endWith(1006);
    expect(events).toEqual(["closed the connection was lost"]);
    expect([performer.isOpen, performer.isClosed, performer.frame(root, rotations)]).toEqual([false, false, false]);
    vi.advanceTimersByTime(250);
    FakeWebSocket.last.accept();
    answerPings();
    expect(events.slice(1)).toEqual(["open "]);
    expect(performer.frame(root, rotations)).toBe(true);
    expect(FakeWebSocket.opened).toHaveLength(2);
    await close(performer);
  });

  test("that is silent is replaced, and not followed when the server closes it", async () => {
    const performer = await openPerformer();
    const silent = FakeWebSocket.last;
    vi.advanceTimersByTime(5_060);
    const replacement = FakeWebSocket.last;
    expect(replacement).not.toBe(silent);
    expect([silent.readyState, events]).toEqual([3, ["closed the connection was lost"]]);
    silent.endWith(1008, "Replaced");
    replacement.accept();
    answerPings();
    expect(events.slice(1)).toEqual(["open "]);
    expect(performer.frame(root, rotations)).toBe(true);
    await close(performer);
  });

  test("that is answered is kept", async () => {
    const performer = await openPerformer();
    for (let second = 0, answered = 1; second < 30; second++) {
      vi.advanceTimersByTime(1_000);
      answered = answerPings(FakeWebSocket.last, answered);
    }
    expect([FakeWebSocket.opened.length, events]).toEqual([1, []]);
    await close(performer);
  });

  test("that the server closes for good ends the performance", async () => {
    const performer = await openPerformer();
    FakeWebSocket.last.endWith(4404, "this performance has ended");
    expect(events).toEqual(["closed this performance has ended", "ended this performance has ended"]);
    expect([performer.isClosed, performer.frame(root, rotations)]).toEqual([true, false]);
    vi.advanceTimersByTime(60_000);
    expect(FakeWebSocket.opened).toHaveLength(1);
    const problem = { title: "Performer not found", status: 404, detail: "it has ended" };
    endResponse = new Response(JSON.stringify(problem), { status: 404 });
    await performer.close();
  });

  test("that is refused rejects, and the performance ends", async () => {
    const opening = Performer.open({ access: new Access(SERVER) });
    const rejection = expect(opening).rejects.toThrow("no such performer");
    await vi.advanceTimersByTimeAsync(0);
    FakeWebSocket.last.endWith(4404, "no such performer");
    await rejection;
    expect(requests.at(-1)?.request).toBe(`DELETE ${SERVER}/v1/performers/p1`);
  });

  test("without an answer rejects, and the performance ends", async () => {
    const opening = Performer.open({ access: new Access(SERVER) });
    const rejection = expect(opening).rejects.toThrow("the server does not answer");
    await vi.advanceTimersByTimeAsync(10_000);
    await rejection;
    expect(requests.at(-1)?.request).toBe(`DELETE ${SERVER}/v1/performers/p1`);
    const count = FakeWebSocket.opened.length;
    await vi.advanceTimersByTimeAsync(60_000);
    expect(FakeWebSocket.opened).toHaveLength(count);
  });
});

describe("close", () => {
  test("ends the performance once the samples are received", async () => {
    const performer = await openPerformer();
    performer.frame(root, rotations);
    const closing = performer.close();
    await vi.advanceTimersByTimeAsync(100);
    expect(requests).toHaveLength(1);
    expect(performer.frame(root, rotations)).toBe(false);
    const socket = FakeWebSocket.last;
    expect(socket.sent.map(({ name }) => name).lastIndexOf("Sample")).toBeGreaterThan(0);
    answerPings(socket, 1);
    await closing;
    expect(requests.slice(1)).toEqual([
      { request: `DELETE ${SERVER}/v1/performers/p1`, body: undefined, keepalive: true },
    ]);
    expect(events).toEqual(["closed closed here", "ended closed here"]);
    expect(socket.readyState).toBe(3);
    await performer.close();
    expect(requests).toHaveLength(2);
  });

  test("ends the performance after 3 s without an answer", async () => {
    const performer = await openPerformer();
    const closing = performer.close();
    await vi.advanceTimersByTimeAsync(3_000);
    await closing;
    expect(requests).toHaveLength(2);
  });

  test("reports that the server cannot be reached, and closes the connection", async () => {
    const performer = await openPerformer();
    endResponse = new Response("", { status: 503 });
    await expect(close(performer)).rejects.toThrow();
    expect(performer.isClosed).toBe(true);
  });
});

test("performance ends with its page", async () => {
  const page = new EventTarget();
  vi.stubGlobal("addEventListener", page.addEventListener.bind(page));
  vi.stubGlobal("removeEventListener", page.removeEventListener.bind(page));
  const performer = await openPerformer();
  page.dispatchEvent(new Event("pagehide"));
  const end = { request: `DELETE ${SERVER}/v1/performers/p1`, body: undefined, keepalive: true };
  expect(requests.slice(1)).toEqual([end]);
  await close(performer);
  page.dispatchEvent(new Event("pagehide"));
  expect(requests.slice(1)).toEqual([end, end]);
});
