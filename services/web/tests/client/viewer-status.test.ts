import { describe, expect, test } from "vitest";
import { describeStatus, type ViewerStatus } from "../../src/client/viewer-status";

const OPEN_STATUS: ViewerStatus = {
  closeReason: null,
  damagedCount: 0,
  hasPose: true,
  isStalled: false,
  choice: null,
  isPinned: false,
};

describe("the panel's reason", () => {
  test("what is wrong goes before what was chosen", () => {
    const choice = { name: "Choice", rate: 4, reason: "best", line: null } as const;
    expect(describeStatus({ ...OPEN_STATUS, choice, closeReason: "the server is gone" })).toBe("the server is gone");
    expect(describeStatus({ ...OPEN_STATUS, choice, damagedCount: 2 })).toBe("2 messages could not be read");
    expect(describeStatus({ ...OPEN_STATUS, choice, hasPose: false })).toBe("waiting for the first block");
    expect(describeStatus({ ...OPEN_STATUS, choice, isStalled: true })).toBe("waiting for a block");
    expect(describeStatus({ ...OPEN_STATUS, choice })).toBe("the best available");
  });

  test("every word of the contract has words for a person, and a narrow line its figure", () => {
    const said = ["best", "line", "hands", "machine", "buffer", "start", "hidden", "pinned"].map((reason) =>
      describeStatus({ ...OPEN_STATUS, choice: { name: "Choice", rate: 1, reason, line: 28_400 } }),
    );
    expect(new Set(said).size).toBe(8);
    for (const words of said) expect(words).toMatch(/ \(28\.4 kbit\/s\)$/);
    expect(describeStatus({ ...OPEN_STATUS, choice: { name: "Choice", rate: 1, reason: "new", line: null } })).toBe(
      "chosen by the server",
    );
    expect(describeStatus({ ...OPEN_STATUS, isPinned: true })).toBe("pinned by the address");
  });
});
