import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { Access, consumeUrlToken, pageAccess, ROLES } from "../../src/client/access";
import { ProblemError } from "../../src/client/problem";
import { ReconnectingConnection } from "../../src/client/reconnecting-connection";
import { forbidStorage, stubStorage } from "../storage/storage-stub";
import { FakeWebSocket } from "./fake-websocket";

/** Return a token with these claims and an invalid signature. */
function makeToken(claims: Record<string, unknown>): string {
  return ["{}", JSON.stringify(claims), "signed"].map((part) => Buffer.from(part).toString("base64url")).join(".");
}

const VIEWER = makeToken({ role: "view", session: "s1", sub: "ÿÿÿ>>>???" });

/** URLs that replaced that of the page. */
let replacedUrls: string[];

function stubLocation(hash: string): void {
  vi.stubGlobal("location", { hash, pathname: "/", search: "?session=s1" });
}

beforeEach(() => {
  replacedUrls = [];
  vi.stubGlobal("history", {
    state: null,
    replaceState: (_: unknown, __: string, url: string) => replacedUrls.push(url),
  });
  stubStorage("sessionStorage");
});
afterEach(() => {
  pageAccess.setToken(null);
  vi.unstubAllGlobals();
});

test.each(["token", "share"])("%s is removed from the URL and stored for the tab", (name) => {
  stubLocation(`#${name}=${VIEWER}`);
  expect(consumeUrlToken()).toBe(true);
  expect(replacedUrls).toEqual(["/?session=s1"]);
  expect(pageAccess.authorization()).toEqual({ Authorization: `Bearer ${VIEWER}` });
  pageAccess.setToken(null);
  stubLocation("");
  expect(consumeUrlToken()).toBe(false);
  expect(pageAccess.hasToken).toBe(true);
});

test("everything is allowed and nothing is sent without a token", () => {
  stubLocation("#elsewhere");
  expect(consumeUrlToken()).toBe(false);
  expect(replacedUrls).toEqual([]);
  expect([pageAccess.hasToken, pageAccess.isRestricted, pageAccess.allows("admin")]).toEqual([false, false, true]);
  expect(pageAccess.authorization()).toEqual({});
  expect(pageAccess.authorizeSocketUrl("ws://stage/stream")).toBe("ws://stage/stream");
});

test("token is used if storage is not available", () => {
  forbidStorage("sessionStorage");
  stubLocation(`#token=${VIEWER}`);
  consumeUrlToken();
  expect(pageAccess.hasToken).toBe(true);
});

test.each([
  [{ role: "view" }, [true, false, false, false]],
  [{ role: "control", session: "s" }, [true, true, false, false]],
  [{ role: "ingest" }, [true, true, true, false]],
  [{ role: "admin" }, [true, true, true, true]],
  [{ role: "owner" }, [true, false, false, false]],
])("token with the claims %j allows %j", (claims, allowed) => {
  pageAccess.setToken(makeToken(claims));
  expect(ROLES.map((role) => pageAccess.allows(role))).toEqual(allowed);
  expect(pageAccess.isRestricted).toBe("session" in claims);
});

test("malformed token allows viewing only", () => {
  pageAccess.setToken("no.token");
  expect(pageAccess.role).toBe("view");
});

test("each socket URL gets its own ticket", async () => {
  pageAccess.setToken(VIEWER);
  let tickets = 0;
  const requests: [string, RequestInit][] = [];
  vi.stubGlobal("fetch", (path: string, options: RequestInit) => {
    requests.push([path, options]);
    return Promise.resolve(new Response(JSON.stringify({ ticket: `t${++tickets}` }), { status: 201 }));
  });
  expect(await pageAccess.authorizeSocketUrl("wss://stage/v1/sessions/s1/stream?rate=1")).toBe(
    "wss://stage/v1/sessions/s1/stream?rate=1&ticket=t1",
  );
  expect(await pageAccess.authorizeSocketUrl("wss://stage/v1/sessions/s1/stream?ticket=old")).toBe(
    "wss://stage/v1/sessions/s1/stream?ticket=t2",
  );
  expect(requests[0]).toMatchObject([
    "https://stage/v1/tickets",
    { method: "POST", headers: { Authorization: `Bearer ${VIEWER}` } },
  ]);
});

test("listener is called for a rejected token only", async () => {
  pageAccess.setToken(VIEWER);
  const denied: string[] = [];
  pageAccess.onUnauthorized(({ title }) => denied.push(title));
  const responses = [
    [401, "Link revoked"],
    [503, "Not now"],
  ] as const;
  for (const [status, title] of responses) {
    vi.stubGlobal("fetch", () => Promise.resolve(new Response(JSON.stringify({ title, detail: "so" }), { status })));
    await expect(pageAccess.authorizeSocketUrl("ws://stage/stream")).rejects.toMatchObject({ status, title });
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

test("connection requests a new URL for each attempt and after a used ticket", async () => {
  FakeWebSocket.install();
  let urlCount = 0;
  const { closed } = connect(() => Promise.resolve(`ws://stage/stream?ticket=${++urlCount}`));
  expect(FakeWebSocket.opened).toHaveLength(0);
  await vi.advanceTimersByTimeAsync(0);
  expect(FakeWebSocket.last.url).toBe("ws://stage/stream?ticket=1");
  FakeWebSocket.last.endWith(4401);
  await vi.advanceTimersByTimeAsync(250);
  expect(FakeWebSocket.last.url).toBe("ws://stage/stream?ticket=2");
  expect(closed).toEqual([["a link is needed", false]]);
  FakeWebSocket.remove();
});

test("connection without a URL is final if rejected, and retried if unreachable", async () => {
  FakeWebSocket.install();
  const rejected = connect(() => Promise.reject(new ProblemError(401, "Link revoked", "who made it has ended it")));
  let attempts = 0;
  const unreachable = connect(() =>
    ++attempts < 3 ? Promise.reject(ProblemError.unreachable()) : Promise.resolve("ws://stage/stream"),
  );
  await vi.advanceTimersByTimeAsync(0);
  expect(rejected.closed).toEqual([["Link revoked: who made it has ended it", true]]);
  expect(unreachable.closed).toEqual([["the server cannot be reached", false]]);
  await vi.advanceTimersByTimeAsync(750);
  expect(FakeWebSocket.opened).toHaveLength(1);
  FakeWebSocket.remove();
});

test("replacement gets its own ticket and is cancelled by a message", async () => {
  FakeWebSocket.install();
  let urlCount = 0;
  const { connection } = connect(() => Promise.resolve(`ws://stage/stream?ticket=${++urlCount}`));
  await vi.advanceTimersByTimeAsync(0);
  const [socket] = FakeWebSocket.opened as [FakeWebSocket];
  socket.accept();
  connection.tryReplacement();
  socket.receive({ name: "Grant", limb: 0, epoch: 1 });
  await vi.advanceTimersByTimeAsync(0);
  expect(FakeWebSocket.opened).toHaveLength(1);
  connection.tryReplacement();
  await vi.advanceTimersByTimeAsync(0);
  expect(FakeWebSocket.last.url).toBe("ws://stage/stream?ticket=3");
  connection.close();
  FakeWebSocket.remove();
});

test("connection closed while waiting for its URL never connects", async () => {
  FakeWebSocket.install();
  const { connection, closed } = connect(() => Promise.resolve("ws://stage/stream"));
  connection.close();
  await vi.advanceTimersByTimeAsync(5_000);
  expect(FakeWebSocket.opened).toHaveLength(0);
  expect(closed).toEqual([["closed here", true]]);
  FakeWebSocket.remove();
});

test("rejection without a ticket is final", () => {
  FakeWebSocket.install();
  const { closed } = connect(() => "ws://stage/stream");
  FakeWebSocket.last.endWith(4401);
  vi.advanceTimersByTime(60_000);
  expect(FakeWebSocket.opened).toHaveLength(1);
  expect(closed).toEqual([["a link is needed", true]]);
  FakeWebSocket.remove();
});

test("each Access uses its own server and token", async () => {
  const requests: [string, string | undefined][] = [];
  vi.stubGlobal("fetch", async (url: string, { headers }: { headers: Record<string, string> }) => {
    requests.push([url, headers.Authorization]);
    return new Response('{"title": "Link revoked", "detail": "it is over"}', { status: 401 });
  });
  pageAccess.setToken(VIEWER);
  const control = makeToken({ role: "control" });
  const [first, second] = [new Access("https://one.example", control), new Access("https://other.example")];
  const denied: string[] = [];
  pageAccess.onUnauthorized(() => denied.push("page"));
  first.onUnauthorized(({ title }) => denied.push(title));
  expect([
    first.allows("control"),
    first.allows("ingest"),
    second.allows("admin"),
    second.hasToken,
    pageAccess.allows("control"),
  ]).toEqual([true, false, true, false, false]);
  await expect(first.request(`${first.server}/v1/sessions`)).rejects.toThrow("Link revoked");
  await expect(second.request(`${second.server}/v1/sessions`)).rejects.toThrow(ProblemError);
  expect(requests).toEqual([
    ["https://one.example/v1/sessions", `Bearer ${control}`],
    ["https://other.example/v1/sessions", undefined],
  ]);
  expect(denied).toEqual(["Link revoked"]);
  expect(second.authorizeSocketUrl("wss://other.example/stream")).toBe("wss://other.example/stream");
});

test("access that is limited to viewing keeps its token and its session", () => {
  const access = new Access("", makeToken({ role: "ingest", session: "s1" }));
  access.limitToViewing();
  expect([access.role, access.allows("control"), access.isRestricted, access.hasToken]).toEqual([
    "view",
    false,
    true,
    true,
  ]);
});
