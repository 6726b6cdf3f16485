import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { ViewerReporter } from "../../src/client/reporter";
import type { ClientMessage } from "../../src/wire/messages";

beforeEach(() => void vi.useFakeTimers());
afterEach(() => void vi.useRealTimers());

function asking() {
  const said: ClientMessage[] = [];
  const line = { there: true };
  const made = new ViewerReporter(
    (message) => line.there && said.push(message) > 0,
    () => performance.now(),
    () => ({ buffer: 1, decode: 2, frame: 3, hidden: false }),
  );
  const sequences = () => said.flatMap((one) => (one.name === "Ping" ? [one.sequence] : []));
  return { made, line, said, sequences };
}

test("the time is asked eight times quickly, then every other second, and how it fares is told every second", () => {
  const { made, said, sequences } = asking();
  made.restart();
  for (let sequence = 0; sequence < 7; sequence++) {
    made.onPong(sequence);
    vi.advanceTimersByTime(60);
  }
  expect(sequences()).toEqual([0, 1, 2, 3, 4, 5, 6, 7]);
  made.onPong(7);
  vi.advanceTimersByTime(1_999);
  expect(sequences()).toHaveLength(8);
  vi.advanceTimersByTime(1);
  expect(sequences()).toHaveLength(9);
  const reports = said.filter(({ name }) => name === "Report");
  expect(reports).toEqual(
    Array.from({ length: 2 }, () => ({ name: "Report", buffer: 1, decode: 2, frame: 3, hidden: false })),
  );
});

test("while two questions are not answered nothing is said; an answer lets the next go at once", () => {
  const { made, said, sequences } = asking();
  made.restart();
  vi.advanceTimersByTime(60);
  expect(sequences()).toEqual([0, 1]);
  vi.advanceTimersByTime(30_000);
  expect(said).toHaveLength(2);
  made.onPong(1);
  expect(sequences()).toEqual([0, 1, 2]);
  made.onPong(1);
  vi.advanceTimersByTime(60);
  expect(sequences()).toEqual([0, 1, 2, 3]);
});

test("without a line nothing is asked; a new one is asked quickly again, and once it is over there is nothing more", () => {
  const { made, line, said, sequences } = asking();
  made.restart();
  line.there = false;
  vi.advanceTimersByTime(10_000);
  expect(sequences()).toEqual([0]);
  line.there = true;
  made.restart();
  vi.advanceTimersByTime(60);
  expect(sequences()).toEqual([0, 0, 1]);
  made.pause();
  vi.advanceTimersByTime(500);
  expect(sequences()).toEqual([0, 0, 1]);
  made.close();
  const all = said.length;
  vi.advanceTimersByTime(60_000);
  expect(said).toHaveLength(all);
});
