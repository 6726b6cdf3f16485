import { describe, expect, test } from "vitest";
import { describeStatus, type ViewerStatus } from "../../src/client/viewer-status";

const OPEN_STATUS: ViewerStatus = {
  closeReason: null,
  damagedCount: 0,
  playback: "playing",
  choice: null,
  isPinned: false,
};

describe("status text", () => {
  test("problems take precedence over the reason for the level", () => {
    const choice = { name: "Choice", rate: 4, reason: "best", line: null } as const;
    expect(describeStatus({ ...OPEN_STATUS, choice, closeReason: "the server is gone" })).toBe("the server is gone");
    expect(describeStatus({ ...OPEN_STATUS, choice, damagedCount: 2 })).toBe("2 messages could not be read");
    expect(describeStatus({ ...OPEN_STATUS, choice, playback: "starting" })).toBe("waiting for the first block");
    expect(describeStatus({ ...OPEN_STATUS, choice, playback: "stalled" })).toBe("waiting for a block");
    expect(describeStatus({ ...OPEN_STATUS, choice })).toBe("the best available");
  });

  test("every reason of the contract has a text, with the link's bitrate if known", () => {
    const texts = ["best", "line", "hands", "machine", "buffer", "start", "hidden", "pinned"].map((reason) =>
      describeStatus({ ...OPEN_STATUS, choice: { name: "Choice", rate: 1, reason, line: 28_400 } }),
    );
    expect(new Set(texts).size).toBe(8);
    for (const text of texts) expect(text).toMatch(/ \(28\.4 kbit\/s\)$/);
    expect(describeStatus({ ...OPEN_STATUS, choice: { name: "Choice", rate: 1, reason: "new", line: null } })).toBe(
      "chosen by the server",
    );
    expect(describeStatus({ ...OPEN_STATUS, isPinned: true })).toBe("pinned by the address");
  });
});
