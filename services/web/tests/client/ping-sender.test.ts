import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { PingSender } from "../../src/client/ping-sender";

beforeEach(() => void vi.useFakeTimers());
afterEach(() => void vi.useRealTimers());

function startPings() {
  const sent: number[] = [];
  const link = { isUp: true };
  const pings = new PingSender(
    ({ sequence }) => link.isUp && sent.push(sequence) > 0,
    () => performance.now(),
  );
  return { pings, link, sent };
}

test("sends 8 pings quickly, then one every 2 s", () => {
  const { pings, sent } = startPings();
  pings.restart();
  for (let sequence = 0; sequence < 7; sequence++) {
    pings.onPong(sequence);
    vi.advanceTimersByTime(60);
  }
  expect(sent).toEqual([0, 1, 2, 3, 4, 5, 6, 7]);
  pings.onPong(7);
  vi.advanceTimersByTime(1_999);
  expect(sent).toHaveLength(8);
  vi.advanceTimersByTime(1);
  expect(sent).toHaveLength(9);
});

test("stops while disconnected or paused, and starts anew on restart", () => {
  const { pings, link, sent } = startPings();
  pings.restart();
  link.isUp = false;
  vi.advanceTimersByTime(10_000);
  expect(sent).toEqual([0]);
  link.isUp = true;
  pings.restart();
  vi.advanceTimersByTime(60);
  expect(sent).toEqual([0, 0, 1]);
  pings.pause();
  vi.advanceTimersByTime(60_000);
  expect(sent).toEqual([0, 0, 1]);
});
