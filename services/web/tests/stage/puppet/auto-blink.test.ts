import { beforeEach, expect, test } from "vitest";
import { blinkWeight } from "../../../src/motion/blink";
import { JOINTS, type Pose, restPose } from "../../../src/motion/skeleton";
import { AutoBlink } from "../../../src/stage/puppet/face/auto-blink";

const FRAME_S = 1 / 60;
const START_S = 1.7e9;

let blinks: AutoBlink;
let pose: Pose;

beforeEach(() => {
  blinks = new AutoBlink();
  pose = restPose();
});

/** Return the weights of `seconds` of frames; `move` changes the pose before each. */
function play(seconds: number, move: (frame: number) => void, from = START_S, interval = FRAME_S): number[] {
  return Array.from({ length: Math.round(seconds / FRAME_S) }, (_, frame) => {
    move(frame);
    return blinks.update(0, pose, from + frame * FRAME_S, interval);
  });
}

const sway = (frame: number) => pose.root.set([0.01 * Math.sin(frame * 0.1), 0.8, 0]);

test("performers that move blink as their seed says, to within a frame", () => {
  const weights = play(30, sway);
  expect(Math.max(...weights)).toBeGreaterThan(0.8);
  weights.forEach((weight, frame) => {
    const near = [-2, -1, 0, 1, 2].map((n) => blinkWeight(START_S + (frame + n) * FRAME_S, 0));
    expect(weight).toBeGreaterThanOrEqual(Math.min(...near) - 0.35);
    expect(weight).toBeLessThanOrEqual(Math.max(...near) + 0.35);
  });
});

test("a performer that stands still never blinks, and opens its eyes when the motion stops", () => {
  expect(Math.max(...play(20, () => {}).slice(1))).toBe(0);
  const start = play(30, sway).findIndex((weight) => weight > 0.5);
  blinks = new AutoBlink();
  const before = play((start + 1) * FRAME_S, sway).at(-1) as number;
  const after = play(1, () => {}, START_S + (start + 1) * FRAME_S);
  expect(before).toBeGreaterThan(0.5);
  expect(Math.max(...after)).toBeLessThanOrEqual(before + FRAME_S / 0.08);
  expect(after.at(-1)).toBe(0);
  for (const [frame, weight] of after.entries()) if (frame > 1) expect(weight).toBeLessThanOrEqual(after[frame - 1]);
});

test("reduced motion has no blinks", () => {
  expect(Math.max(...play(20, sway, START_S, 0))).toBe(0);
});

test("fast turns of the head come with more blinks", () => {
  const skull = JOINTS.indexOf("skullbase") * 4;
  const turn = (frame: number) => {
    sway(frame);
    const phase = (frame % 150) / 150;
    const angle = 0.8 * Math.min(1, Math.max(0, (phase - 0.5) * 8)) * (Math.floor(frame / 150) % 2 ? -1 : 1);
    pose.rotations.set([Math.cos(angle / 2), 0, Math.sin(angle / 2), 0], skull);
  };
  const count = (weights: number[]) =>
    weights.filter((weight, n) => n > 0 && weight > 0 && weights[n - 1] === 0).length;
  const calm = count(play(120, sway));
  blinks = new AutoBlink();
  const turning = count(play(120, turn));
  expect(turning).toBeGreaterThan(calm * 1.3);
});

test("values of a pose that are not numbers close no eyes", () => {
  pose.rotations.fill(Number.NaN);
  for (const weight of play(3, () => {})) expect(weight).toBeGreaterThanOrEqual(0);
});
