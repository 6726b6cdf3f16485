import { expect, test } from "vitest";
import { BitrateMeter } from "../../src/client/bitrate-meter";

test("bitrate is zero before the first byte", () => {
  expect(new BitrateMeter().kbps(5_000)).toBe(0);
});

test("constant bitrate is measured", () => {
  const meter = new BitrateMeter();
  for (let now = 0; now < 10_000; now += 50) meter.add(now, 100);
  expect(meter.kbps(10_000)).toBeGreaterThan(14);
  expect(meter.kbps(10_000)).toBeLessThan(18);
});

test("bytes older than the window are dropped", () => {
  const meter = new BitrateMeter();
  meter.add(0, 1_000_000);
  expect(meter.kbps(2_000)).toBeGreaterThan(0);
  expect(meter.kbps(3_200)).toBe(0);
  expect(meter.kbps(1_000_000)).toBe(0);
});
