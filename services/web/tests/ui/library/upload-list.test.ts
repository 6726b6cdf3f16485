import { expect, test } from "vitest";
import { shareOfStage } from "../../../src/ui/library/upload-list";

test("the share of a stage is that of all takes", () => {
  expect(shareOfStage({ stage: "encoding", share: 0.5 })).toBe(0.5);
  expect(shareOfStage({ stage: "encoding", share: 0.5, take: 2, takes: 4 })).toBe(0.375);
});
