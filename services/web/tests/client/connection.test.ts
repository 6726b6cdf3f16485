import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { Connection } from "../../src/client/connection";
import type { Message } from "../../src/wire/messages";
import { japaneseSpeech } from "../../src/words/language";
import { pageSpeech } from "../../src/words/say";
import { Line } from "./line";

beforeEach(() => Line.install());
afterEach(() => Line.remove());

function connect(answered = false, speech = pageSpeech) {
  const heard: Message[] = [], closed: [string, boolean][] = [], malformed: string[] = [];
  let open = 0, replacements = 0;
  const connection = new Connection({
    url: () => "ws://stage/stream",
    answered,
    speech,
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
  expect([Line.last.protocol, Line.last.binaryType]).toEqual(["bunraku.v1", "arraybuffer"]);
  expect(connection.send({ name: "Claim", limb: 0 })).toBe(false);
  Line.last.accept();
  expect(connection.send({ name: "Claim", limb: 0 })).toBe(true);
  Line.last.say({ name: "Grant", limb: 0, epoch: 4 });
  expect(opened()).toBe(1);
  expect(Line.last.sent).toEqual([{ name: "Claim", limb: 0 }]);
  expect(heard).toEqual([{ name: "Grant", limb: 0, epoch: 4 }]);
});

test("skips unknown types and goes on after a message that cannot be read", () => {
  const { heard, malformed } = connect();
  Line.last.accept();
  Line.last.raw(Uint8Array.of(40, 1, 2));
  Line.last.raw(Uint8Array.of(10, 0xc1));
  Line.last.raw("text");
  Line.last.say({ name: "Grant", limb: 1, epoch: 1 });
  expect(malformed).toHaveLength(2);
  expect(heard).toHaveLength(1);
});

test("comes back after 250 ms, then twice as late each time up to 4 s, and at once anew after a message", () => {
  connect();
  const waits = [250, 500, 1000, 2000, 4000, 4000];
  waits.forEach((wait, lost) => {
    Line.last.end(1006);
    vi.advanceTimersByTime(wait - 1);
    expect(Line.opened).toHaveLength(lost + 1);
    vi.advanceTimersByTime(1);
    expect(Line.opened).toHaveLength(lost + 2);
  });
  Line.last.accept();
  Line.last.say({ name: "Grant", limb: 1, epoch: 1 });
  Line.last.end(1011);
  vi.advanceTimersByTime(250);
  expect(Line.opened).toHaveLength(waits.length + 2);
});

test.each([1000, 1008, 1009, 4404, 4406])("does not come back after %i", (code) => {
  const { closed } = connect();
  Line.last.accept();
  Line.last.end(code);
  vi.advanceTimersByTime(60_000);
  expect(Line.opened).toHaveLength(1);
  expect(closed).toHaveLength(1);
  expect(closed[0][1]).toBe(true);
});

test("says why: the server's problem, else the close's reason, else plain words", () => {
  const { closed } = connect();
  Line.last.accept();
  Line.last.say({ name: "Problem", title: "Too slow", detail: "40 messages waited" });
  Line.last.end(1013, "Too slow");
  vi.advanceTimersByTime(250);
  Line.last.end(1011, "out of disk");
  vi.advanceTimersByTime(500);
  Line.last.end(1006);
  expect(closed.map(([reason]) => reason)).toEqual([
    "Too slow: 40 messages waited", "out of disk", "the line was lost",
  ]);
});

test("closed here it stays closed, and says so once", () => {
  const { connection, closed, heard } = connect();
  const line = Line.last;
  line.accept();
  connection.close();
  connection.close();
  line.say({ name: "Grant", limb: 1, epoch: 1 });
  line.end(1000);
  vi.advanceTimersByTime(60_000);
  expect(closed).toEqual([["closed here", true]]);
  expect(heard).toEqual([]);
  expect(Line.opened).toHaveLength(1);
});

const ASKED: Message = { name: "Ping", sequence: 0, sent: 1 };
const HEARD: Message = { name: "Grant", limb: 0, epoch: 4 };

test("another line is tried once nothing was heard for four seconds after something was said, and is the line once it is heard", () => {
  const { connection, heard, closed, opened, replaced } = connect(true);
  const silent = Line.last;
  silent.accept();
  silent.say(HEARD);
  // nothing was asked since
  vi.advanceTimersByTime(30_000);
  expect(Line.opened).toHaveLength(1);
  connection.send({ ...ASKED } as never);
  vi.advanceTimersByTime(3_999);
  expect(Line.opened).toHaveLength(1);
  vi.advanceTimersByTime(1);
  expect(Line.opened).toHaveLength(2);
  const other = Line.last;
  other.accept();
  expect([opened(), silent.readyState]).toEqual([1, 1]);
  other.say(HEARD);
  expect([opened(), replaced(), silent.readyState, other.readyState]).toEqual([2, 1, 3, 1]);
  connection.send({ ...ASKED } as never);
  expect(other.sent).toHaveLength(1);
  // what the old one says still, and its end, are nothing to anybody
  silent.say(HEARD);
  silent.end(1006);
  expect([heard.length, closed.length]).toEqual([2, 0]);
});

test("a silent line that is heard first stays, and the other is let go", () => {
  const { connection, heard, opened } = connect(true);
  const silent = Line.last;
  silent.accept();
  connection.send({ ...ASKED } as never);
  vi.advanceTimersByTime(4_000);
  const other = Line.last;
  silent.say(HEARD);
  expect([Line.opened.length, other.readyState, silent.readyState, opened(), heard.length]).toEqual([2, 3, 1, 1, 1]);
  other.end(1006);
  silent.say(HEARD);
  expect(heard).toHaveLength(2);
});

test("a line that does not come about is tried beside too, again and again, one at a time", () => {
  const { closed } = connect(true);
  vi.advanceTimersByTime(12_000);
  expect(Line.opened.map(({ readyState }) => readyState)).toEqual([0, 3, 3, 0]);
  Line.opened[0].end(1006);
  expect(closed).toEqual([["the line was lost", false]]);
  expect(Line.last.readyState).toBe(3);
  vi.advanceTimersByTime(250);
  expect(Line.opened).toHaveLength(5);
});

test("without answers to be expected silence means nothing; another line can be asked for", () => {
  const { connection, replaced } = connect();
  Line.last.accept();
  connection.send({ name: "Claim", limb: 0 });
  vi.advanceTimersByTime(60_000);
  expect(Line.opened).toHaveLength(1);
  connection.renew();
  Line.last.say(HEARD);
  expect([Line.opened.length, replaced()]).toEqual([2, 1]);
  connection.close();
  connection.renew();
  expect([Line.opened.length, Line.last.readyState]).toEqual([2, 3]);
});

test("why it is gone is told in its own words, what the server says of it too", async () => {
  const speech = await japaneseSpeech();
  const { closed } = connect(false, speech);
  Line.last.end(1006);
  const { connection, closed: here } = connect(false, speech);
  Line.last.accept();
  connection.close();
  const { closed: refused } = connect(false, speech);
  Line.last.accept();
  Line.last.say({ name: "Problem", title: "No such session", detail: "there is no session abc" });
  Line.last.end(4404);
  expect([closed, here, refused]).toEqual([[["回線が途切れました", false]], [["こちらで閉じました", true]], [["その舞台は見つかりません：舞台abcはありません", true]]]);
});
