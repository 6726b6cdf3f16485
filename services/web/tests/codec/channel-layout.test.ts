import { expect, test } from "vitest";
import { createLayout, MOTION_LAYOUT } from "../../src/codec/channel-layout";
import { JOINTS } from "../../src/motion/skeleton";

const RELATIVES = [MOTION_LAYOUT.parents, MOTION_LAYOUT.mirrors, MOTION_LAYOUT.grandparents];

/** Returns the joint of a channel, or that it is the root's position. */
const channelName = (channel: number) => (channel === 0 ? "position" : channel === 19 ? "none" : JOINTS[channel - 1]);

test("relative channels follow the skeleton", () => {
  const relativesOf = (channel: number) => RELATIVES.map((relation) => channelName(relation[channel]));
  expect(relativesOf(0)).toEqual(["none", "none", "none"]);
  expect(relativesOf(1)).toEqual(["position", "none", "none"]);
  expect(relativesOf(2)).toEqual(["humanoid_root", "humanoid_root", "position"]);
  expect(relativesOf(JOINTS.indexOf("r_knee") + 1)).toEqual(["r_hip", "l_knee", "sacroiliac"]);
  expect(relativesOf(JOINTS.indexOf("l_elbow") + 1)).toEqual(["l_shoulder", "l_shoulder", "vl5"]);
  for (const relatives of RELATIVES) {
    relatives.forEach((relative, channel) => expect(relative < channel || relative === 19).toBe(true));
  }
});

test("a layout has grandparents and three axes", () => {
  const layout = createLayout([11, 12, 13], [-1, 0, 1], [-1, -1, 1]);
  expect([...layout.grandparents]).toEqual([3, 3, 0]);
  expect([...layout.axes]).toEqual([3, 3, 3]);
  expect(layout.heading).toBe(false);
});
