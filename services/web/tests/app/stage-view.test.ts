import { expect, test } from "vitest";
import { readStageView, StageViewError } from "../../src/app/stage-view";

const read = (query: string) => readStageView(new URLSearchParams(query));

test("without a view in its address, the page has its controls", () => {
  expect(read("session=abc&background=transparent")).toBe(null);
});

test("the stage has its own background and camera, or those of the address", () => {
  expect(read("view=stage")).toEqual({ isTransparent: false, camera: null });
  expect(read("view=stage&background=transparent&camera=0,1.4,5,0,1,0")).toEqual({
    isTransparent: true,
    camera: [0, 1.4, 5, 0, 1, 0, (26 * Math.PI) / 180],
  });
  expect(read("view=stage&camera=-2, 1e0,+3,0,1,0,90")?.camera).toEqual([-2, 1, 3, 0, 1, 0, Math.PI / 2]);
});

test.each([
  ["view=control", "view=control is unknown"],
  ["view=", "view= is unknown"],
  ["view=stage&background=green", "background=green is unknown"],
  ["view=stage&camera=", "6 or 7 numbers"],
  ["view=stage&camera=0,1,5,0,1", "6 or 7 numbers"],
  ["view=stage&camera=0,1,5,0,1,0,26,1", "6 or 7 numbers"],
  ["view=stage&camera=0,1,5,0,,0", "6 or 7 numbers"],
  ["view=stage&camera=0,1,NaN,0,1,0", "6 or 7 numbers"],
  ["view=stage&camera=0,1,Infinity,0,1,0", "6 or 7 numbers"],
  ["view=stage&camera=0,1,101,0,1,0", "100 metres"],
  ["view=stage&camera=0,1,0,0,1,0", "the same place"],
  ["view=stage&camera=0,1,5,0,1,0,0", "5 to 120 degrees"],
  ["view=stage&camera=0,1,5,0,1,0,180", "5 to 120 degrees"],
])("%s is refused with the reason", (query, reason) => {
  expect(() => read(query)).toThrow(StageViewError);
  expect(() => read(query)).toThrow(reason);
});
