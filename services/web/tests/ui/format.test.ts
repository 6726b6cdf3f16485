import { describe, expect, test } from "vitest";
import {
  formatBytes,
  formatDuration,
  formatFigure,
  formatIngestStage,
  formatUploadProgress,
  initialOf,
  motionNameFromFile,
} from "../../src/ui/format";

describe("formats", () => {
  test("durations", () => {
    expect([0, 9.99, 87, 204, 3671].map(formatDuration)).toEqual(["0:00", "0:09", "1:27", "3:24", "1:01:11"]);
    expect([-1, Number.NaN, Infinity].map(formatDuration)).toEqual(["0:00", "0:00", "0:00"]);
  });

  test("bytes", () => {
    expect([950, 12_345, 999_999, 8_100_000].map(formatBytes)).toEqual(["1.0 kB", "12 kB", "1000 kB", "8.1 MB"]);
  });

  test("upload progress with remaining time", () => {
    expect(formatUploadProgress(8_100_000, 13_000_000, 6.6)).toBe("8.1 MB of 13.0 MB, 4 s left");
    expect(formatUploadProgress(0, 13_000_000, 2)).toBe("0.0 kB of 13.0 MB");
    expect(formatUploadProgress(13_000_000, 13_000_000, 9)).toBe("13.0 MB of 13.0 MB, reading the dance");
  });

  test("stages of an upload", () => {
    expect((["waiting", "reading", "encoding"] as const).map(formatIngestStage)).toEqual([
      "queued",
      "reading the dance",
      "encoding the dance",
    ]);
  });

  test("figures, initials and file names", () => {
    expect([3.4567, 12.34, 184.2, Number.NaN].map(formatFigure)).toEqual(["3.46", "12.3", "184", "-"]);
    expect([" aiko", "", "élan"].map(initialOf)).toEqual(["A", "?", "É"]);
    expect(["perfume_A.bvh", ".bvh", "a.b.csv"].map(motionNameFromFile)).toEqual(["perfume A", ".bvh", "a.b"]);
  });
});
