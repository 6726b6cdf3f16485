/** What a page in a real browser holds of dancers that went. */
import type { CDPSession, Page } from "playwright-core";
import { expect, test } from "vitest";
import { describeInBrowser } from "./browser-suite";
import { createBowingBvh } from "./bvh-file";
import { waitForFirstPose, waitForWelcome } from "./page-probe";

/** Times that another dances, after each has danced. */
const CHANGES = 6;

declare global {
  interface Window {
    /** What was on the stage before, as far as anything holds it still. */
    gone: WeakRef<object>[];
  }
}

describeInBrowser("a page on which dancers came and went", { demo: true }, (own) => {
  test("holds none of them, neither they nor their motion, and nothing more of the graphics", async () => {
    const page = await own.open("", { viewport: { width: 260, height: 220 } });
    const protocol = await page.context().newCDPSession(page);
    await waitForFirstPose(page);
    await waitForWelcome(page);
    const [piece, other] = ["Sanba", "bows"];
    await page
      .locator('input[type=file][accept*=".bvh"]')
      .setInputFiles({ name: "bows.bvh", mimeType: "text/plain", buffer: Buffer.from(createBowingBvh(60)) });
    await page.locator(".brand-piece", { hasText: other }).waitFor({ state: "attached" });
    await waitForFirstPose(page);
    await choose(page, piece);
    const before = await graphics(page);
    await page.evaluate(() => (window.gone = []));
    for (let nth = 0; nth < CHANGES; nth++) {
      await page.evaluate(() => {
        const { stage, viewer } = window.bunraku;
        for (const one of [stage.puppet, viewer.figure]) if (one) window.gone.push(new WeakRef(one));
      });
      await choose(page, nth % 2 === 0 ? other : piece);
    }
    expect(await page.evaluate(() => window.gone.length)).toBe(2 * CHANGES);
    expect(await graphics(page)).toEqual(before);
    await expect.poll(() => held(page, protocol)).toBe(0);
  });
});

/** Has a dance of the library danced, by a part of its name, and waits for its first pose. */
async function choose(page: Page, name: string): Promise<void> {
  await page.evaluate(
    (name) =>
      [...document.querySelectorAll<HTMLElement>(".motion")].find((one) => one.textContent?.includes(name))?.click(),
    name,
  );
  await page.locator(".brand-piece", { hasText: name }).waitFor({ state: "attached" });
  await waitForFirstPose(page);
}

/** What three.js has in the graphics' memory once all that is there was drawn. */
async function graphics(page: Page): Promise<Record<string, number>> {
  const frame = await page.evaluate(() => window.bunraku.stage.renderer.info.render.frame);
  await page.waitForFunction((frame) => window.bunraku.stage.renderer.info.render.frame > frame + 1, frame);
  return page.evaluate(() => {
    const { memory, programs } = window.bunraku.stage.renderer.info;
    return { ...memory, programs: programs?.length ?? 0 };
  });
}

/** How many of those that went are held by anything once garbage was collected. */
async function held(page: Page, protocol: CDPSession): Promise<number> {
  await protocol.send("HeapProfiler.collectGarbage");
  return page.evaluate(() => window.gone.filter((one) => one.deref()).length);
}
