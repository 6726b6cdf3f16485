import { expect, test } from "vitest";
import { AdaptiveQuality, QUALITY_LEVELS } from "../../../src/stage/rendering/quality";

function run(choice: AdaptiveQuality, seconds: number, frames: number): number {
  for (let i = 0; i < frames; i++) choice.addFrameTime(seconds);
  return QUALITY_LEVELS.indexOf(choice.quality);
}

test("fast frames keep the best quality, slow frames reduce it to the last", () => {
  expect(run(new AdaptiveQuality("", false), 1 / 60, 1000)).toBe(0);
  expect(run(new AdaptiveQuality("", false), 1 / 15, 9)).toBe(1);
  expect(run(new AdaptiveQuality("", false), 1 / 15, 1000)).toBe(QUALITY_LEVELS.length - 1);
  expect(run(new AdaptiveQuality("", false), 1.5, 5)).toBe(2);
});

/** Frame time of a machine that draws the level in this time, on a display with 60 Hz. */
function displayed(cost: number): number {
  return Math.ceil(cost * 60 - 1e-6) / 60;
}

/** Draw for `seconds` on a machine that needs `costs[level]` seconds a frame; return the levels in the order of change. */
function drawFor(choice: AdaptiveQuality, seconds: number, costs: readonly number[]): number[] {
  const levels: number[] = [];
  for (let passed = 0; passed < seconds; ) {
    const frame = displayed(costs[QUALITY_LEVELS.indexOf(choice.quality)]);
    passed += frame;
    if (choice.addFrameTime(frame)) levels.push(QUALITY_LEVELS.indexOf(choice.quality));
  }
  return levels;
}

const FAST = [0.005, 0.005, 0.005, 0.005, 0.005];

test("after a slow moment the quality returns to the best in less than a minute", () => {
  const choice = new AdaptiveQuality("", false);
  drawFor(choice, 10, [0.2, 0.2, 0.2, 0.2, 0.2]);
  expect(QUALITY_LEVELS.indexOf(choice.quality)).toBe(4);
  expect(drawFor(choice, 60, FAST)).toEqual([3, 2, 1, 0]);
});

test("a level that is too slow is tried ever more rarely", () => {
  const choice = new AdaptiveQuality("", false);
  const costs = [0.08, 0.06, 0.012, 0.008, 0.004];
  drawFor(choice, 10, costs);
  expect(QUALITY_LEVELS.indexOf(choice.quality)).toBe(2);
  const tried = drawFor(choice, 600, costs);
  expect(tried.length).toBeLessThanOrEqual(12);
  expect(new Set(tried)).toEqual(new Set([1, 2]));
  // From now on there is at most one trial in five minutes.
  expect(drawFor(choice, 300, costs).length).toBeLessThanOrEqual(2);
});

test("a level between slow and fast is neither reduced nor raised", () => {
  const choice = new AdaptiveQuality("", false);
  run(choice, 1 / 15, 9);
  expect(run(choice, 1 / 25, 5000)).toBe(1);
});

test("a machine that becomes slow for ever after a trial has passed is reduced again", () => {
  const choice = new AdaptiveQuality("", false);
  drawFor(choice, 10, [0.2, 0.2, 0.2, 0.2, 0.2]);
  drawFor(choice, 60, FAST);
  expect(drawFor(choice, 60, [0.1, 0.1, 0.1, 0.1, 0.01]).at(-1)).toBe(4);
});

test("software rendering never gets materials that it cannot draw", () => {
  const choice = new AdaptiveQuality("SwiftShader", false);
  drawFor(choice, 5, [1, 1, 1, 1, 1]);
  drawFor(choice, 300, FAST);
  expect(QUALITY_LEVELS.indexOf(choice.quality)).toBe(3);
});

test("a single stutter and a page in the background do not count", () => {
  const choice = new AdaptiveQuality("", false);
  for (let i = 0; i < 200; i++) choice.addFrameTime(i % 10 === 0 ? 0.2 : 1 / 60);
  choice.addFrameTime(600);
  expect(QUALITY_LEVELS.indexOf(choice.quality)).toBe(0);
});

test("a software renderer starts lower unless quality is pinned", () => {
  expect(new AdaptiveQuality("ANGLE (Google, Vulkan 1.3 (SwiftShader Device))", false).quality.simpleMaterials).toBe(
    true,
  );
  expect(new AdaptiveQuality("ANGLE (Google, Vulkan 1.3 (SwiftShader Device))", true).quality.simpleMaterials).toBe(
    false,
  );
  expect(new AdaptiveQuality("ANGLE (Apple M2)", false).quality.simpleMaterials).toBe(false);
});

test("frames after a restart are not measured, since shaders are compiled", () => {
  const choice = new AdaptiveQuality("", false);
  run(choice, 1 / 60, 100);
  choice.restart();
  expect(run(choice, 2, 3)).toBe(0);
  expect(run(choice, 2, 1)).toBe(2);
});
