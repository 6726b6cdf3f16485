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
