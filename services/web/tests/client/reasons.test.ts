import { describe, expect, test } from "vitest";
import { reasonOf, type Standing } from "../../src/client/reasons";

const well: Standing = { closed: null, damaged: 0, shown: true, missing: false, choice: null, pinned: false };

describe("the panel's reason", () => {
  test("what is wrong goes before what was chosen", () => {
    const choice = { name: "Choice", rate: 4, reason: "best", line: null } as const;
    expect(reasonOf({ ...well, choice, closed: "the server is gone" })).toBe("the server is gone");
    expect(reasonOf({ ...well, choice, damaged: 2 })).toBe("2 messages could not be read");
    expect(reasonOf({ ...well, choice, shown: false })).toBe("waiting for the first block");
    expect(reasonOf({ ...well, choice, missing: true })).toBe("waiting for a block");
    expect(reasonOf({ ...well, choice })).toBe("the best there is");
  });

  test("every word of the contract has words for a person, and a narrow line its figure", () => {
    const said = ["best", "line", "hands", "machine", "buffer", "start", "hidden", "pinned"].map((reason) =>
      reasonOf({ ...well, choice: { name: "Choice", rate: 1, reason, line: 28_400 } }),
    );
    expect(new Set(said).size).toBe(8);
    for (const words of said) expect(words).toMatch(/ \(28\.4 kbit\/s\)$/);
    expect(reasonOf({ ...well, choice: { name: "Choice", rate: 1, reason: "new", line: null } })).toBe("chosen by the server");
    expect(reasonOf({ ...well, pinned: true })).toBe("pinned by the address");
  });
});
