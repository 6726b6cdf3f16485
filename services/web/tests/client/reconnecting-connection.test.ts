import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { ReconnectingConnection } from "../../src/client/reconnecting-connection";
import { loadJapaneseTranslator } from "../../src/i18n/language";
import { pageTranslator } from "../../src/i18n/translator";
import type { Message } from "../../src/wire/messages";
import { FakeWebSocket } from "./fake-websocket";

beforeEach(() => FakeWebSocket.install());
afterEach(() => FakeWebSocket.remove());

function connect(expectsAnswers = false, translator = pageTranslator) {
  const received: Message[] = [],
    closed: [string, boolean][] = [],
    malformed: string[] = [];
  let open = 0,
    replacements = 0;
  const connection = new ReconnectingConnection({
    url: () => "ws://stage/stream",
    expectsAnswers,
    translator,
    onOpen: (replaced) => {
      open++;
      if (replaced) replacements++;
    },
    onMessage: (message) => received.push(message),
    onMalformed: (error) => malformed.push(error.message),
    onClosed: (reason, final) => closed.push([reason, final]),
  });
  return { connection, received, closed, malformed, opened: () => open, replaced: () => replacements };
}

test("offers the subprotocol and sends only while open", () => {
  const { connection, received, opened } = connect();
  expect([FakeWebSocket.last.protocol, FakeWebSocket.last.binaryType]).toEqual(["bunraku.v1", "arraybuffer"]);
  expect(connection.send({ name: "Claim", limb: 0 })).toBe(false);
  FakeWebSocket.last.accept();
  expect(connection.send({ name: "Claim", limb: 0 })).toBe(true);
  FakeWebSocket.last.receive({ name: "Grant", limb: 0, epoch: 4 });
  expect(opened()).toBe(1);
  expect(FakeWebSocket.last.sent).toEqual([{ name: "Claim", limb: 0 }]);
  expect(received).toEqual([{ name: "Grant", limb: 0, epoch: 4 }]);
});

test("skips unknown types and continues after a malformed message", () => {
  const { received, malformed } = connect();
  FakeWebSocket.last.accept();
  FakeWebSocket.last.receiveRaw(Uint8Array.of(40, 1, 2));
  FakeWebSocket.last.receiveRaw(Uint8Array.of(10, 0xc1));
  FakeWebSocket.last.receiveRaw("text");
  FakeWebSocket.last.receive({ name: "Grant", limb: 1, epoch: 1 });
  expect(malformed).toHaveLength(2);
  expect(received).toHaveLength(1);
});

test("retries after 250 ms, doubling up to 4 s, until a message arrives", () => {
  connect();
  const waits = [250, 500, 1000, 2000, 4000, 4000];
  waits.forEach((wait, lost) => {
    FakeWebSocket.last.endWith(1006);
    vi.advanceTimersByTime(wait - 1);
    expect(FakeWebSocket.opened).toHaveLength(lost + 1);
    vi.advanceTimersByTime(1);
    expect(FakeWebSocket.opened).toHaveLength(lost + 2);
  });
  FakeWebSocket.last.accept();
  FakeWebSocket.last.receive({ name: "Grant", limb: 1, epoch: 1 });
  FakeWebSocket.last.endWith(1011);
  vi.advanceTimersByTime(250);
  expect(FakeWebSocket.opened).toHaveLength(waits.length + 2);
});

test.each([1000, 1008, 1009, 4404, 4406])("does not retry after close code %i", (code) => {
  const { closed } = connect();
  FakeWebSocket.last.accept();
  FakeWebSocket.last.endWith(code);
  vi.advanceTimersByTime(60_000);
  expect(FakeWebSocket.opened).toHaveLength(1);
  expect(closed).toHaveLength(1);
  expect(closed[0][1]).toBe(true);
});

test("reason is the server's problem, else the close reason, else a text", () => {
  const { closed } = connect();
  FakeWebSocket.last.accept();
  FakeWebSocket.last.receive({ name: "Problem", title: "Too slow", detail: "40 messages waited" });
  FakeWebSocket.last.endWith(1013, "Too slow");
  vi.advanceTimersByTime(250);
  FakeWebSocket.last.endWith(1011, "out of disk");
  vi.advanceTimersByTime(500);
  FakeWebSocket.last.endWith(1006);
  expect(closed.map(([reason]) => reason)).toEqual([
    "Too slow: 40 messages waited",
    "out of disk",
    "the connection was lost",
  ]);
});

test("close is final and reported once", () => {
  const { connection, closed, received } = connect();
  const socket = FakeWebSocket.last;
  socket.accept();
  connection.close();
  connection.close();
  socket.receive({ name: "Grant", limb: 1, epoch: 1 });
  socket.endWith(1000);
  vi.advanceTimersByTime(60_000);
  expect(closed).toEqual([["closed here", true]]);
  expect(received).toEqual([]);
  expect(FakeWebSocket.opened).toHaveLength(1);
});

const PING: Message = { name: "Ping", sequence: 0, sent: 1 };
const GRANT: Message = { name: "Grant", limb: 0, epoch: 4 };

test("silence for 4 s after a ping starts a replacement, which takes over", () => {
  const { connection, received, closed, opened, replaced } = connect(true);
  const silent = FakeWebSocket.last;
  silent.accept();
  silent.receive(GRANT);
  // nothing was sent since
  vi.advanceTimersByTime(30_000);
  expect(FakeWebSocket.opened).toHaveLength(1);
  connection.send({ ...PING } as never);
  vi.advanceTimersByTime(3_999);
  expect(FakeWebSocket.opened).toHaveLength(1);
  vi.advanceTimersByTime(1);
  expect(FakeWebSocket.opened).toHaveLength(2);
  const replacement = FakeWebSocket.last;
  replacement.accept();
  expect([opened(), silent.readyState]).toEqual([1, 1]);
  replacement.receive(GRANT);
  expect([opened(), replaced(), silent.readyState, replacement.readyState]).toEqual([2, 1, 3, 1]);
  connection.send({ ...PING } as never);
  expect(replacement.sent).toHaveLength(1);
  // messages and close of the replaced connection are ignored
  silent.receive(GRANT);
  silent.endWith(1006);
  expect([received.length, closed.length]).toEqual([2, 0]);
});

test("message on the silent connection cancels the replacement", () => {
  const { connection, received, opened } = connect(true);
  const silent = FakeWebSocket.last;
  silent.accept();
  connection.send({ ...PING } as never);
  vi.advanceTimersByTime(4_000);
  const replacement = FakeWebSocket.last;
  silent.receive(GRANT);
  expect([FakeWebSocket.opened.length, replacement.readyState, silent.readyState, opened(), received.length]).toEqual([
    2, 3, 1, 1, 1,
  ]);
  replacement.endWith(1006);
  silent.receive(GRANT);
  expect(received).toHaveLength(2);
});

test("connection that does not open is replaced repeatedly, one at a time", () => {
  const { closed } = connect(true);
  vi.advanceTimersByTime(12_000);
  expect(FakeWebSocket.opened.map(({ readyState }) => readyState)).toEqual([0, 3, 3, 0]);
  FakeWebSocket.opened[0].endWith(1006);
  expect(closed).toEqual([["the connection was lost", false]]);
  expect(FakeWebSocket.last.readyState).toBe(3);
  vi.advanceTimersByTime(250);
  expect(FakeWebSocket.opened).toHaveLength(5);
});

test("silence is ignored without expected answers; tryReplacement works", () => {
  const { connection, replaced } = connect();
  FakeWebSocket.last.accept();
  connection.send({ name: "Claim", limb: 0 });
  vi.advanceTimersByTime(60_000);
  expect(FakeWebSocket.opened).toHaveLength(1);
  connection.tryReplacement();
  FakeWebSocket.last.receive(GRANT);
  expect([FakeWebSocket.opened.length, replaced()]).toEqual([2, 1]);
  connection.close();
  connection.tryReplacement();
  expect([FakeWebSocket.opened.length, FakeWebSocket.last.readyState]).toEqual([2, 3]);
});

test("reasons are in the language of the translator", async () => {
  const translator = await loadJapaneseTranslator();
  const { closed } = connect(false, translator);
  FakeWebSocket.last.endWith(1006);
  const { connection, closed: closedHere } = connect(false, translator);
  FakeWebSocket.last.accept();
  connection.close();
  const { closed: rejected } = connect(false, translator);
  FakeWebSocket.last.accept();
  FakeWebSocket.last.receive({ name: "Problem", title: "No such session", detail: "there is no session abc" });
  FakeWebSocket.last.endWith(4404);
  expect([closed, closedHere, rejected]).toEqual([
    [["回線が途切れました", false]],
    [["こちらで閉じました", true]],
    [["その舞台は見つかりません：舞台abcはありません", true]],
  ]);
});
