import { expect, test } from "vitest";
import { asList, asRecord, asText } from "../../../src/avatar/gltf/json";

test("values of another type are empty", () => {
  expect([null, 7, "x", undefined].map(asRecord)).toEqual([{}, {}, {}, {}]);
  expect([null, {}, "x", { length: 1 }].map(asList)).toEqual([[], [], [], []]);
  expect([null, 7, " ", " x "].map(asText)).toEqual([null, null, null, "x"]);
});
