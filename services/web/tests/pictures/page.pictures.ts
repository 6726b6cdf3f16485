/** Screenshots of the page for README and docs: `make pictures`. */
import { mkdirSync } from "node:fs";
import { resolve } from "node:path";
import type { Page } from "playwright-core";
import { test } from "vitest";
import { type BrowserFixture, describeInBrowser } from "../browser/browser-suite";
import { evaluateInEngine, waitInEngine } from "../browser/engine-probe";
import {
  jointPosition,
  ringPosition,
  waitForDraw,
  waitForFirstPose,
  waitForHold,
  waitUntilSettled,
} from "../browser/page-probe";

const PICTURE_FOLDER = resolve(import.meta.dirname, "../../../../docs/pictures");
const DESKTOP = { width: 1440, height: 900 };
const PHONE = { width: 390, height: 844 };

/** Motion time of a held pose of the demo, in seconds. */
const POSE_TIME_S = 11.4;

type Theme = "dark" | "light";

/** Limb index and drag distance of each puppeteer, in CSS pixels on a stage 900 pixels high. */
const DRAGS: Readonly<Record<string, readonly [limb: number, x: number, y: number]>> = {
  Aiko: [0, 70, -250],
  Mateo: [3, -60, -90],
  You: [1, -130, -160],
};

describeInBrowser("pictures", { server: "open", timeout: 400_000 }, (fixture) => {
  test("desktop in both themes", async () => {
    mkdirSync(PICTURE_FOLDER, { recursive: true });
    const page = await openStage(fixture, "dark", DESKTOP);
    await takeScreenshot(page, "night");
    for (const panel of ["Library", "Strings", "Connection"])
      await page.getByRole("button", { name: panel, exact: true }).click();
    await waitForPlots(page);
    await takeScreenshot(page, "panels");
    await page.keyboard.press("Shift+Slash");
    await takeScreenshot(page, "keys");
    await takeScreenshot(await openStage(fixture, "light", DESKTOP), "day");
  });

  test("several puppeteers", async () => {
    const page = await openStage(fixture, "dark", DESKTOP, "You");
    for (const name of ["Aiko", "Mateo"])
      await dragLimb(await openStage(fixture, "dark", { width: 760, height: 480 }, name, false), name);
    await dragLimb(page, "You");
    await waitUntilSettled(page, () => jointPosition(page, "r_wrist"), 0.002);
    await takeScreenshot(page, "strings");
  });

  test("phone", async () => {
    const page = await openStage(fixture, "dark", PHONE);
    await takeScreenshot(page, "phone");
    await page.getByRole("button", { name: "Strings", exact: true }).click();
    await takeScreenshot(page, "phone-strings");
    const day = await openStage(fixture, "light", PHONE);
    await day.getByRole("button", { name: "Connection", exact: true }).click();
    await waitForPlots(day);
    await takeScreenshot(day, "phone-day");
  });
});

/** Open a page as a puppeteer of this name, paused at the held pose. */
async function openStage(
  fixture: BrowserFixture,
  colorScheme: Theme,
  viewport: { width: number; height: number },
  name = "You",
  best = true,
): Promise<Page> {
  const page = await fixture.open(`?name=${name}${best ? "&quality=best" : ""}`, {
    colorScheme,
    viewport,
    reducedMotion: "reduce",
  });
  await waitForFirstPose(page);
  const pause = page.getByRole("button", { name: "Pause" });
  if (await pause.isVisible()) await pause.click();
  const bar = await page.getByRole("slider", { name: "Seek" }).boundingBox();
  if (!bar) throw new Error("The page has no seek bar");
  const durationS = await evaluateInEngine(page, () => globalThis.bunraku.viewer.duration);
  await page.mouse.click(bar.x + (bar.width * POSE_TIME_S) / durationS, bar.y + bar.height / 2);
  await page.mouse.move(viewport.width / 2, 4);
  await waitInEngine(
    page,
    (at) => Math.abs(globalThis.bunraku.viewer.positionAt(performance.now()) - at) < 0.5,
    POSE_TIME_S,
  );
  await waitUntilSettled(page, () => jointPosition(page, "r_wrist"), 0.002);
  return page;
}

/** Drag the limb of this puppeteer and keep holding it. */
async function dragLimb(page: Page, name: string): Promise<void> {
  const [limb, x, y] = DRAGS[name] as readonly [number, number, number];
  const ring = await ringPosition(page, limb);
  const scale = (page.viewportSize()?.height ?? 900) / 900;
  await page.mouse.move(ring.x, ring.y);
  await page.mouse.down();
  await page.mouse.move(ring.x + x * scale, ring.y + y * scale, { steps: 4 });
  await waitForHold(page, limb);
}

/** Wait for 20 s of data in the connection's plots. */
async function waitForPlots(page: Page): Promise<void> {
  await page.waitForTimeout(20_000);
}

async function takeScreenshot(page: Page, name: string): Promise<void> {
  await waitForDraw(page);
  await page.screenshot({ path: resolve(PICTURE_FOLDER, `${name}.jpg`), type: "jpeg", quality: 82 });
  if (process.env["BUNRAKU_PICTURES_PNG"])
    await page.screenshot({ path: resolve(process.env["BUNRAKU_PICTURES_PNG"], `${name}.png`) });
}
