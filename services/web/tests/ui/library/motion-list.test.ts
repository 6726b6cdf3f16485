import { expect, test } from "vitest";
import type { Motion } from "../../../src/client/api";
import { toMotionItem } from "../../../src/ui/library/motion-list";

const motion: Motion = {
  id: "m1",
  name: "",
  filename: "old_steps.bvh",
  created: "2026-01-01T00:00:00Z",
  duration: 12.5,
  fps: 59.94,
};

test("motion item has a name and a short description", () => {
  expect(toMotionItem(motion)).toEqual({
    id: "m1",
    name: "old steps",
    detail: "BVH, 59.9 Hz",
    seconds: 12.5,
    performers: 1,
  });
  expect(
    toMotionItem({ ...motion, name: "Old Steps", filename: "", fps: 120, tracks: ["motion", "camera", "audio"] }),
  ).toMatchObject({ name: "Old Steps", detail: "120 Hz, with music" });
  expect(toMotionItem({ ...motion, tracks: ["motion", "light"] }).detail).toBe("BVH, 59.9 Hz");
  expect(toMotionItem({ ...motion, filename: "", performers: 2, tracks: ["motion", "audio", "motion"] })).toMatchObject(
    { detail: "59.9 Hz, 2 dancers, with music", performers: 2 },
  );
});
