import { expect, test } from "vitest";
import { AdaptiveQuality, BEST_QUALITY, GRAPHICS_LEVELS, SOFTWARE_LEVELS } from "../../../src/stage/rendering/quality";

const SOFTWARE = "ANGLE (Google, Vulkan 1.3 (SwiftShader Device))";
const WORST = GRAPHICS_LEVELS.length - 1;

/** Draw frames that take this time; return the level. */
function run(choice: AdaptiveQuality, seconds: number, frames: number): number {
  for (let i = 0; i < frames; i++) choice.addFrameTime(seconds);
  return GRAPHICS_LEVELS.indexOf(choice.quality);
}

/** Frame time of a machine that draws the level in this time, on a display with 60 Hz. */
function displayed(cost: number): number {
  return Math.ceil(cost * 60 - 1e-6) / 60;
}

/**
 * Draw for `seconds` on a machine that needs `cost(level)` seconds a frame; return the levels in the order of change.
 */
function drawFor(choice: AdaptiveQuality, seconds: number, cost: (level: number) => number): number[] {
  const levels: number[] = [];
  for (let passed = 0; passed < seconds; ) {
    const frame = displayed(cost(GRAPHICS_LEVELS.indexOf(choice.quality)));
    passed += frame;
    if (choice.addFrameTime(frame, 1 / 60)) levels.push(GRAPHICS_LEVELS.indexOf(choice.quality));
  }
  return levels;
}

const always = (seconds: number) => () => seconds;

test("levels get cheaper in small steps, and never below 0.6 of the resolution", () => {
  for (const levels of [GRAPHICS_LEVELS, SOFTWARE_LEVELS])
    levels.forEach(({ pixelRatioScale, ...details }, at) => {
      expect(pixelRatioScale).toBeGreaterThanOrEqual(0.6);
      const { pixelRatioScale: before, ...detailsBefore } = levels[Math.max(0, at - 1)];
      expect(before - pixelRatioScale).toBeLessThanOrEqual(0.11);
      if (JSON.stringify(details) === JSON.stringify(detailsBefore))
        expect(pixelRatioScale).toBeLessThanOrEqual(before);
    });
});

test("fast frames keep the best quality, slow frames reduce it to the last", () => {
  expect(run(new AdaptiveQuality("", false), 1 / 60, 1000)).toBe(0);
  expect(run(new AdaptiveQuality("", false), 1 / 40, 9)).toBe(1);
  expect(run(new AdaptiveQuality("", false), 1 / 25, 9)).toBe(2);
  expect(run(new AdaptiveQuality("", false), 1 / 15, 1000)).toBe(WORST);
});

test("a display that is slow is no reason to reduce the quality", () => {
  const choice = new AdaptiveQuality("", false);
  for (let i = 0; i < 1000; i++) choice.addFrameTime(1 / 30, 1 / 30);
  expect(choice.quality).toBe(BEST_QUALITY);
  // A browser that waits for each frame shows no interval but the machine's.
  for (let i = 0; i < 9; i++) choice.addFrameTime(1 / 15, 1 / 15);
  expect(choice.quality).not.toBe(BEST_QUALITY);
});

test("after a slow moment the quality returns to the best in a minute", () => {
  const choice = new AdaptiveQuality("", false);
  drawFor(choice, 10, always(0.2));
  expect(GRAPHICS_LEVELS.indexOf(choice.quality)).toBe(WORST);
  expect(drawFor(choice, 60, always(0.005))).toEqual(Array.from({ length: WORST }, (_, at) => WORST - 1 - at));
});

test("a level that is too slow is tried ever more rarely", () => {
  const choice = new AdaptiveQuality("", false);
  const cost = (level: number) => (level < 2 ? 0.03 : 0.012);
  drawFor(choice, 10, cost);
  expect(GRAPHICS_LEVELS.indexOf(choice.quality)).toBe(2);
  const tried = drawFor(choice, 600, cost);
  expect(tried.length).toBeLessThanOrEqual(14);
  expect(new Set(tried)).toEqual(new Set([1, 2]));
  // From now on there is at most one trial in five minutes.
  expect(drawFor(choice, 300, cost).length).toBeLessThanOrEqual(2);
});

test("a level between slow and fast is neither reduced nor raised", () => {
  const choice = new AdaptiveQuality("", false);
  run(choice, 1 / 40, 9);
  expect(run(choice, 1.2 / 60, 5000)).toBe(1);
});

test("a machine that becomes slow for ever after a trial has passed is reduced again", () => {
  const choice = new AdaptiveQuality("", false);
  drawFor(choice, 10, always(0.2));
  drawFor(choice, 60, always(0.005));
  expect(drawFor(choice, 60, always(0.1)).at(-1)).toBe(WORST);
});

test("software rendering aims at 30 frames a second, and never gets materials that it cannot draw", () => {
  const choice = new AdaptiveQuality(SOFTWARE, false);
  for (let i = 0; i < 1000; i++) choice.addFrameTime(1.2 / 30);
  expect(choice.quality.pixelRatioScale).toBe(0.75);
  for (let i = 0; i < 100; i++) choice.addFrameTime(1);
  expect(choice.quality).toBe(SOFTWARE_LEVELS.at(-1));
  for (let i = 0; i < 5000; i++) choice.addFrameTime(1 / 60);
  expect(choice.quality).toBe(SOFTWARE_LEVELS[0]);
  expect(choice.bestQuality).toBe(SOFTWARE_LEVELS[0]);
  expect(choice.bestQuality.simpleMaterials).toBe(true);
});

test("in software the picture stays clean at 20 frames a second, and becomes clean again", () => {
  const choice = new AdaptiveQuality(SOFTWARE, false);
  for (let i = 0; i < 1000; i++) choice.addFrameTime(1 / 20.5);
  expect(choice.quality.pixelRatioScale).toBe(0.75);
  for (let i = 0; i < 100; i++) choice.addFrameTime(1 / 15);
  expect(choice.quality.pixelRatioScale).toBe(0.6);
  for (let i = 0; i < 1000; i++) choice.addFrameTime(1 / 20.5);
  expect(choice.quality.pixelRatioScale).toBe(0.75);
});

test("in software slow frames in a row do not reduce a clean picture that has 20 frames a second otherwise", () => {
  const choice = new AdaptiveQuality(SOFTWARE, false);
  for (let second = 0; second < 120; second++) {
    for (let i = 0; i < 14; i++) choice.addFrameTime(0.045);
    for (let i = 0; i < 6; i++) choice.addFrameTime(0.07);
    expect(choice.quality.pixelRatioScale).toBe(0.75);
  }
});

test("in software a machine on which only the coarse picture reaches 20 frames a second shows that one", () => {
  const choice = new AdaptiveQuality(SOFTWARE, false);
  const shown = new Map<number, number>();
  for (let i = 0; i < 10_000; i++) {
    const { pixelRatioScale } = choice.quality;
    const seconds = pixelRatioScale > 0.6 ? 1 / 18 : 1 / 21;
    shown.set(pixelRatioScale, (shown.get(pixelRatioScale) ?? 0) + seconds);
    choice.addFrameTime(seconds);
  }
  const total = [...shown.values()].reduce((sum, seconds) => sum + seconds);
  expect(shown.get(0.6)! / total).toBeGreaterThan(0.95);
});

test("a single stutter and a page in the background do not count", () => {
  const choice = new AdaptiveQuality("", false);
  for (let i = 0; i < 200; i++) choice.addFrameTime(i % 10 === 0 ? 0.2 : 1 / 60);
  choice.addFrameTime(600);
  expect(choice.quality).toBe(BEST_QUALITY);
});

test("a software renderer starts lower unless quality is pinned", () => {
  expect(new AdaptiveQuality(SOFTWARE, false).quality.simpleMaterials).toBe(true);
  expect(new AdaptiveQuality(SOFTWARE, true).quality).toBe(BEST_QUALITY);
  expect(new AdaptiveQuality("ANGLE (Apple M2)", false).quality).toBe(BEST_QUALITY);
});

test("frames after a restart are not measured, since shaders are compiled", () => {
  const choice = new AdaptiveQuality("", false);
  run(choice, 1 / 60, 100);
  choice.restart();
  expect(run(choice, 2, 3)).toBe(0);
  expect(run(choice, 2, 1)).toBe(4);
});
