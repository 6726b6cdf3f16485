import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { ReconnectingConnection } from "../../src/client/reconnecting-connection";
import { loadJapaneseTranslator } from "../../src/i18n/language";
import { pageTranslator } from "../../src/i18n/translator";
import type { Message } from "../../src/wire/messages";
import { FakeWebSocket } from "./fake-websocket";

beforeEach(() => FakeWebSocket.install());
afterEach(() => FakeWebSocket.remove());

function connect(answered = false, speech = pageTranslator) {
  const heard: Message[] = [],
    closed: [string, boolean][] = [],
    malformed: string[] = [];
  let open = 0,
    replacements = 0;
  const connection = new ReconnectingConnection({
    url: () => "ws://stage/stream",
    expectsAnswers: answered,
    translator: speech,
    onOpen: (replaced) => {
      open++;
      if (replaced) replacements++;
    },
    onMessage: (message) => heard.push(message),
    onMalformed: (error) => malformed.push(error.message),
    onClosed: (reason, final) => closed.push([reason, final]),
  });
  return { connection, heard, closed, malformed, opened: () => open, replaced: () => replacements };
}

test("offers the subprotocol, takes bytes, and sends only over an open line", () => {
  const { connection, heard, opened } = connect();
  expect([FakeWebSocket.last.protocol, FakeWebSocket.last.binaryType]).toEqual(["bunraku.v1", "arraybuffer"]);
  expect(connection.send({ name: "Claim", limb: 0 })).toBe(false);
  FakeWebSocket.last.accept();
  expect(connection.send({ name: "Claim", limb: 0 })).toBe(true);
  FakeWebSocket.last.receive({ name: "Grant", limb: 0, epoch: 4 });
  expect(opened()).toBe(1);
  expect(FakeWebSocket.last.sent).toEqual([{ name: "Claim", limb: 0 }]);
  expect(heard).toEqual([{ name: "Grant", limb: 0, epoch: 4 }]);
});

test("skips unknown types and goes on after a message that cannot be read", () => {
  const { heard, malformed } = connect();
  FakeWebSocket.last.accept();
  FakeWebSocket.last.receiveRaw(Uint8Array.of(40, 1, 2));
  FakeWebSocket.last.receiveRaw(Uint8Array.of(10, 0xc1));
  FakeWebSocket.last.receiveRaw("text");
  FakeWebSocket.last.receive({ name: "Grant", limb: 1, epoch: 1 });
  expect(malformed).toHaveLength(2);
  expect(heard).toHaveLength(1);
});

test("comes back after 250 ms, then twice as late each time up to 4 s, and at once anew after a message", () => {
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

test.each([1000, 1008, 1009, 4404, 4406])("does not come back after %i", (code) => {
  const { closed } = connect();
  FakeWebSocket.last.accept();
  FakeWebSocket.last.endWith(code);
  vi.advanceTimersByTime(60_000);
  expect(FakeWebSocket.opened).toHaveLength(1);
  expect(closed).toHaveLength(1);
  expect(closed[0][1]).toBe(true);
});

test("says why: the server's problem, else the close's reason, else plain words", () => {
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

test("closed here it stays closed, and says so once", () => {
  const { connection, closed, heard } = connect();
  const line = FakeWebSocket.last;
  line.accept();
  connection.close();
  connection.close();
  line.receive({ name: "Grant", limb: 1, epoch: 1 });
  line.endWith(1000);
  vi.advanceTimersByTime(60_000);
  expect(closed).toEqual([["closed here", true]]);
  expect(heard).toEqual([]);
  expect(FakeWebSocket.opened).toHaveLength(1);
});

const ASKED: Message = { name: "Ping", sequence: 0, sent: 1 };
const HEARD: Message = { name: "Grant", limb: 0, epoch: 4 };

test("another line is tried once nothing was heard for four seconds after something was said, and is the line once it is heard", () => {
  const { connection, heard, closed, opened, replaced } = connect(true);
  const silent = FakeWebSocket.last;
  silent.accept();
  silent.receive(HEARD);
  // nothing was asked since
  vi.advanceTimersByTime(30_000);
  expect(FakeWebSocket.opened).toHaveLength(1);
  connection.send({ ...ASKED } as never);
  vi.advanceTimersByTime(3_999);
  expect(FakeWebSocket.opened).toHaveLength(1);
  vi.advanceTimersByTime(1);
  expect(FakeWebSocket.opened).toHaveLength(2);
  const other = FakeWebSocket.last;
  other.accept();
  expect([opened(), silent.readyState]).toEqual([1, 1]);
  other.receive(HEARD);
  expect([opened(), replaced(), silent.readyState, other.readyState]).toEqual([2, 1, 3, 1]);
  connection.send({ ...ASKED } as never);
  expect(other.sent).toHaveLength(1);
  // what the old one says still, and its end, are nothing to anybody
  silent.receive(HEARD);
  silent.endWith(1006);
  expect([heard.length, closed.length]).toEqual([2, 0]);
});

test("a silent line that is heard first stays, and the other is let go", () => {
  const { connection, heard, opened } = connect(true);
  const silent = FakeWebSocket.last;
  silent.accept();
  connection.send({ ...ASKED } as never);
  vi.advanceTimersByTime(4_000);
  const other = FakeWebSocket.last;
  silent.receive(HEARD);
  expect([FakeWebSocket.opened.length, other.readyState, silent.readyState, opened(), heard.length]).toEqual([
    2, 3, 1, 1, 1,
  ]);
  other.endWith(1006);
  silent.receive(HEARD);
  expect(heard).toHaveLength(2);
});

test("a line that does not come about is tried beside too, again and again, one at a time", () => {
  const { closed } = connect(true);
  vi.advanceTimersByTime(12_000);
  expect(FakeWebSocket.opened.map(({ readyState }) => readyState)).toEqual([0, 3, 3, 0]);
  FakeWebSocket.opened[0].endWith(1006);
  expect(closed).toEqual([["the connection was lost", false]]);
  expect(FakeWebSocket.last.readyState).toBe(3);
  vi.advanceTimersByTime(250);
  expect(FakeWebSocket.opened).toHaveLength(5);
});

test("without answers to be expected silence means nothing; another line can be asked for", () => {
  const { connection, replaced } = connect();
  FakeWebSocket.last.accept();
  connection.send({ name: "Claim", limb: 0 });
  vi.advanceTimersByTime(60_000);
  expect(FakeWebSocket.opened).toHaveLength(1);
  connection.tryReplacement();
  FakeWebSocket.last.receive(HEARD);
  expect([FakeWebSocket.opened.length, replaced()]).toEqual([2, 1]);
  connection.close();
  connection.tryReplacement();
  expect([FakeWebSocket.opened.length, FakeWebSocket.last.readyState]).toEqual([2, 3]);
});

test("why it is gone is told in its own words, what the server says of it too", async () => {
  const speech = await loadJapaneseTranslator();
  const { closed } = connect(false, speech);
  FakeWebSocket.last.endWith(1006);
  const { connection, closed: here } = connect(false, speech);
  FakeWebSocket.last.accept();
  connection.close();
  const { closed: refused } = connect(false, speech);
  FakeWebSocket.last.accept();
  FakeWebSocket.last.receive({ name: "Problem", title: "No such session", detail: "there is no session abc" });
  FakeWebSocket.last.endWith(4404);
  expect([closed, here, refused]).toEqual([
    [["回線が途切れました", false]],
    [["こちらで閉じました", true]],
    [["その舞台は見つかりません：舞台abcはありません", true]],
  ]);
});
