import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { ViewerReporter } from "../../src/client/reporter";
import type { ClientMessage } from "../../src/wire/messages";

beforeEach(() => void vi.useFakeTimers());
afterEach(() => void vi.useRealTimers());

function startReporter() {
  const sent: ClientMessage[] = [];
  const link = { isUp: true };
  const reporter = new ViewerReporter(
    (message) => link.isUp && sent.push(message) > 0,
    () => performance.now(),
    () => ({ buffer: 1, decode: 2, frame: 3, hidden: false }),
  );
  const sequences = () => sent.flatMap((message) => (message.name === "Ping" ? [message.sequence] : []));
  return { reporter, link, sent, sequences };
}

test("sends 8 pings quickly, then one every 2 s, and a report every second", () => {
  const { reporter, sent, sequences } = startReporter();
  reporter.restart();
  for (let sequence = 0; sequence < 7; sequence++) {
    reporter.onPong(sequence);
    vi.advanceTimersByTime(60);
  }
  expect(sequences()).toEqual([0, 1, 2, 3, 4, 5, 6, 7]);
  reporter.onPong(7);
  vi.advanceTimersByTime(1_999);
  expect(sequences()).toHaveLength(8);
  vi.advanceTimersByTime(1);
  expect(sequences()).toHaveLength(9);
  const reports = sent.filter(({ name }) => name === "Report");
  expect(reports).toEqual(
    Array.from({ length: 2 }, () => ({ name: "Report", buffer: 1, decode: 2, frame: 3, hidden: false })),
  );
});

test("sends nothing while two pings are unanswered, then a ping at once", () => {
  const { reporter, sent, sequences } = startReporter();
  reporter.restart();
  vi.advanceTimersByTime(60);
  expect(sequences()).toEqual([0, 1]);
  vi.advanceTimersByTime(30_000);
  expect(sent).toHaveLength(2);
  reporter.onPong(1);
  expect(sequences()).toEqual([0, 1, 2]);
  reporter.onPong(1);
  vi.advanceTimersByTime(60);
  expect(sequences()).toEqual([0, 1, 2, 3]);
});

test("sends nothing while disconnected or closed, and starts anew on restart", () => {
  const { reporter, link, sent, sequences } = startReporter();
  reporter.restart();
  link.isUp = false;
  vi.advanceTimersByTime(10_000);
  expect(sequences()).toEqual([0]);
  link.isUp = true;
  reporter.restart();
  vi.advanceTimersByTime(60);
  expect(sequences()).toEqual([0, 0, 1]);
  reporter.pause();
  vi.advanceTimersByTime(500);
  expect(sequences()).toEqual([0, 0, 1]);
  reporter.close();
  const count = sent.length;
  vi.advanceTimersByTime(60_000);
  expect(sent).toHaveLength(count);
});
