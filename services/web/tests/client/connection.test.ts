import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { Connection } from "../../src/client/connection";
import type { Message } from "../../src/wire/messages";
import { Line } from "./line";

beforeEach(() => Line.install());
afterEach(() => Line.remove());

function connect() {
  const heard: Message[] = [], closed: [string, boolean][] = [], malformed: string[] = [];
  let open = 0;
  const connection = new Connection({
    url: () => "ws://stage/stream",
    onOpen: () => open++,
    onMessage: (message) => heard.push(message),
    onMalformed: (error) => malformed.push(error.message),
    onClosed: (reason, final) => closed.push([reason, final]),
  });
  return { connection, heard, closed, malformed, opened: () => open };
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
