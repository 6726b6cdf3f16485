import { afterEach, beforeEach, expect, test, vi } from "vitest";
import * as access from "../../src/client/access";
import { ProblemError } from "../../src/client/problem";
import { ReconnectingConnection } from "../../src/client/reconnecting-connection";
import { forbidStorage, stubStorage } from "../storage/storage-stub";
import { FakeWebSocket } from "./fake-websocket";

/** A token as the server makes them, but for its signature. */
function token(claims: Record<string, unknown>): string {
  return ["{}", JSON.stringify(claims), "signed"].map((part) => Buffer.from(part).toString("base64url")).join(".");
}

const VIEWER = token({ role: "view", session: "s1", sub: "ÿÿÿ>>>???" });

let shown: string[];

function arrive(hash: string): void {
  vi.stubGlobal("location", { hash, pathname: "/", search: "?session=s1" });
}

beforeEach(() => {
  shown = [];
  vi.stubGlobal("history", { state: null, replaceState: (_: unknown, __: string, url: string) => shown.push(url) });
  stubStorage("sessionStorage");
});
afterEach(() => {
  access.hold(null);
  vi.unstubAllGlobals();
});

test.each(["token", "share"])("a %s leaves the address at once and stays with the tab", (name) => {
  arrive(`#${name}=${VIEWER}`);
  expect(access.consumeUrlToken()).toBe(true);
  expect(shown).toEqual(["/?session=s1"]);
  expect(access.authorization()).toEqual({ Authorization: `Bearer ${VIEWER}` });
  access.hold(null);
  arrive("");
  expect(access.consumeUrlToken()).toBe(false);
  expect(access.guarded()).toBe(true);
});

test("without one everything is offered and nothing is sent", () => {
  arrive("#elsewhere");
  expect(access.consumeUrlToken()).toBe(false);
  expect(shown).toEqual([]);
  expect([access.guarded(), access.bound(), access.may("admin")]).toEqual([false, false, true]);
  expect(access.authorization()).toEqual({});
  expect(access.ticketed("ws://stage/stream")).toBe("ws://stage/stream");
});

test("storage may be forbidden", () => {
  forbidStorage("sessionStorage");
  arrive(`#token=${VIEWER}`);
  access.consumeUrlToken();
  expect(access.guarded()).toBe(true);
});

test.each([
  [{ role: "view" }, [true, false, false, false]],
  [{ role: "control", session: "s" }, [true, true, false, false]],
  [{ role: "ingest" }, [true, true, true, false]],
  [{ role: "admin" }, [true, true, true, true]],
  [{ role: "owner" }, [true, false, false, false]],
])("what %j may do is told by its token", (claims, may) => {
  access.hold(token(claims));
  expect(access.ROLES.map(access.may)).toEqual(may);
  expect(access.bound()).toBe("session" in claims);
});

test("what cannot be read lets see: the server says what is wrong with it", () => {
  access.hold("no.token");
  expect(access.currentRole()).toBe("view");
});

test("a socket's address gets a ticket for each attempt", async () => {
  access.hold(VIEWER);
  let tickets = 0;
  const asked: [string, RequestInit][] = [];
  vi.stubGlobal("fetch", (path: string, options: RequestInit) => {
    asked.push([path, options]);
    return Promise.resolve(new Response(JSON.stringify({ ticket: `t${++tickets}` }), { status: 201 }));
  });
  expect(await access.ticketed("wss://stage/v1/sessions/s1/stream?rate=1")).toBe(
    "wss://stage/v1/sessions/s1/stream?rate=1&ticket=t1",
  );
  expect(await access.ticketed("wss://stage/v1/sessions/s1/stream?ticket=old")).toBe(
    "wss://stage/v1/sessions/s1/stream?ticket=t2",
  );
  expect(asked[0]).toMatchObject([
    "https://stage/v1/tickets",
    { method: "POST", headers: { Authorization: `Bearer ${VIEWER}` } },
  ]);
});

test("one who is not let in is told once more than the request is refused", async () => {
  access.hold(VIEWER);
  const denied: string[] = [];
  access.whenDenied(({ title }) => denied.push(title));
  const answers = [
    [401, "Link revoked"],
    [503, "Not now"],
  ] as const;
  for (const [status, title] of answers) {
    vi.stubGlobal("fetch", () => Promise.resolve(new Response(JSON.stringify({ title, detail: "so" }), { status })));
    await expect(access.ticketed("ws://stage/stream")).rejects.toMatchObject({ status, title });
  }
  expect(denied).toEqual(["Link revoked"]);
});

function connect(url: () => string | Promise<string>) {
  const closed: [string, boolean][] = [];
  const connection = new ReconnectingConnection({
    url,
    onOpen: () => undefined,
    onMessage: () => undefined,
    onMalformed: () => undefined,
    onClosed: (reason, final) => closed.push([reason, final]),
  });
  return { connection, closed };
}

test("a connection waits for its address, asks anew each time, and after a ticket that was used up", async () => {
  FakeWebSocket.install();
  let asked = 0;
  const { closed } = connect(() => Promise.resolve(`ws://stage/stream?ticket=${++asked}`));
  expect(FakeWebSocket.opened).toHaveLength(0);
  await vi.advanceTimersByTimeAsync(0);
  expect(FakeWebSocket.last.url).toBe("ws://stage/stream?ticket=1");
  FakeWebSocket.last.endWith(4401);
  await vi.advanceTimersByTimeAsync(250);
  expect(FakeWebSocket.last.url).toBe("ws://stage/stream?ticket=2");
  expect(closed).toEqual([["a link is needed", false]]);
  FakeWebSocket.remove();
});

test("a connection that gets no address is over where it never will, and tries again where nobody answers", async () => {
  FakeWebSocket.install();
  const refused = connect(() => Promise.reject(new ProblemError(401, "Link revoked", "who made it has ended it")));
  let tries = 0;
  const away = connect(() =>
    ++tries < 3 ? Promise.reject(ProblemError.unreachable()) : Promise.resolve("ws://stage/stream"),
  );
  await vi.advanceTimersByTimeAsync(0);
  expect(refused.closed).toEqual([["Link revoked: who made it has ended it", true]]);
  expect(away.closed).toEqual([["the server cannot be reached", false]]);
  await vi.advanceTimersByTimeAsync(750);
  expect(FakeWebSocket.opened).toHaveLength(1);
  FakeWebSocket.remove();
});

test("another line is tried with a ticket of its own, unless the silent one speaks meanwhile", async () => {
  FakeWebSocket.install();
  let asked = 0;
  const { connection } = connect(() => Promise.resolve(`ws://stage/stream?ticket=${++asked}`));
  await vi.advanceTimersByTimeAsync(0);
  const [first] = FakeWebSocket.opened as [FakeWebSocket];
  first.accept();
  connection.tryReplacement();
  first.receive({ name: "Grant", limb: 0, epoch: 1 });
  await vi.advanceTimersByTimeAsync(0);
  expect(FakeWebSocket.opened).toHaveLength(1);
  connection.tryReplacement();
  await vi.advanceTimersByTimeAsync(0);
  expect(FakeWebSocket.last.url).toBe("ws://stage/stream?ticket=3");
  connection.close();
  FakeWebSocket.remove();
});

test("closed here while it waits for its address it never connects", async () => {
  FakeWebSocket.install();
  const { connection, closed } = connect(() => Promise.resolve("ws://stage/stream"));
  connection.close();
  await vi.advanceTimersByTimeAsync(5_000);
  expect(FakeWebSocket.opened).toHaveLength(0);
  expect(closed).toEqual([["closed here", true]]);
  FakeWebSocket.remove();
});

test("without a ticket, not being let in is final", () => {
  FakeWebSocket.install();
  const { closed } = connect(() => "ws://stage/stream");
  FakeWebSocket.last.endWith(4401);
  vi.advanceTimersByTime(60_000);
  expect(FakeWebSocket.opened).toHaveLength(1);
  expect(closed).toEqual([["a link is needed", true]]);
  FakeWebSocket.remove();
});

test("a page comes in at several servers, each by its own", async () => {
  const sent: [string, string | undefined][] = [];
  vi.stubGlobal("fetch", async (url: string, { headers }: { headers: Record<string, string> }) => {
    sent.push([url, headers.Authorization]);
    return new Response('{"title": "Link revoked", "detail": "it is over"}', { status: 401 });
  });
  access.hold(VIEWER);
  const control = token({ role: "control" });
  const [one, other] = [new access.Access("https://one.example", control), new access.Access("https://other.example")];
  const denied: string[] = [];
  access.whenDenied(() => denied.push("page"));
  one.onUnauthorized(({ title }) => denied.push(title));
  expect([
    one.allows("control"),
    one.allows("ingest"),
    other.allows("admin"),
    other.hasToken,
    access.may("control"),
  ]).toEqual([true, false, true, false, false]);
  await expect(one.request(`${one.server}/v1/sessions`)).rejects.toThrow("Link revoked");
  await expect(other.request(`${other.server}/v1/sessions`)).rejects.toThrow(ProblemError);
  expect(sent).toEqual([
    ["https://one.example/v1/sessions", `Bearer ${control}`],
    ["https://other.example/v1/sessions", undefined],
  ]);
  expect(denied).toEqual(["Link revoked"]);
  expect(other.authorizeSocketUrl("wss://other.example/stream")).toBe("wss://other.example/stream");
});
