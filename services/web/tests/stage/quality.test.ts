import { expect, test } from "vitest";
import { QUALITIES, QualityChoice } from "../../src/stage/quality";

function run(choice: QualityChoice, seconds: number, frames: number): number {
  for (let i = 0; i < frames; i++) choice.frame(seconds);
  return QUALITIES.indexOf(choice.quality);
}

test("quick frames keep the best, slow ones step down to the last and no further", () => {
  expect(run(new QualityChoice("", false), 1 / 60, 1000)).toBe(0);
  expect(run(new QualityChoice("", false), 1 / 15, 9)).toBe(1);
  expect(run(new QualityChoice("", false), 1 / 15, 1000)).toBe(QUALITIES.length - 1);
  expect(run(new QualityChoice("", false), 1.5, 5)).toBe(2);
});

test("one stutter among quick frames, and a hidden tab, are no slow machine", () => {
  const choice = new QualityChoice("", false);
  for (let i = 0; i < 200; i++) choice.frame(i % 10 === 0 ? 0.2 : 1 / 60);
  choice.frame(600);
  expect(QUALITIES.indexOf(choice.quality)).toBe(0);
});

test("a software renderer starts lower, unless the best is asked for", () => {
  expect(new QualityChoice("ANGLE (Google, Vulkan 1.3 (SwiftShader Device))", false).quality.plain).toBe(true);
  expect(new QualityChoice("ANGLE (Google, Vulkan 1.3 (SwiftShader Device))", true).quality.plain).toBe(false);
  expect(new QualityChoice("ANGLE (Apple M2)", false).quality.plain).toBe(false);
});

test("frames after the machine was busy with something else are no measure", () => {
  const choice = new QualityChoice("GPU", false);
  for (let i = 0; i < 3; i++) choice.frame(0.01);
  for (let i = 0; i < 5; i++) choice.frame(0.2);
  choice.forgive();
  for (let i = 0; i < 3; i++) expect(choice.frame(2)).toBe(false);
  expect(choice.frame(0.01)).toBe(false);
  expect(choice.quality).toBe(QUALITIES[0]);
  expect(choice.frame(2)).toBe(true);
});
