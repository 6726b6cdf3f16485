/** Memory of the page after changes of the motion. */
import type { Page } from "playwright-core";
import { expect, test } from "vitest";
import { describeInBrowser } from "./browser-suite";
import { createBowingBvh } from "./bvh-file";
import { evaluateInEngine, waitInEngine } from "./engine-probe";
import { collectGarbage, openThreadProtocols, type ThreadProtocol } from "./engine-protocol";
import { waitForFirstPose, waitForWelcome } from "./page-probe";

/** Changes of the motion after each has been played once. */
const CHANGES = 6;

declare global {
  /** In the engine's realm: puppets and figures that were replaced. */
  var replaced: WeakRef<object>[];
}

describeInBrowser("memory", { server: "open" }, (fixture) => {
  test("replaced performers are freed from the heap and the graphics memory", async () => {
    const page = await fixture.open("", { viewport: { width: 260, height: 220 } });
    const threads = await openThreadProtocols(page);
    await waitForFirstPose(page);
    await waitForWelcome(page);
    const [demo, uploaded] = ["Sanba", "memorable bows"];
    await page
      .locator('input[type=file][accept*=".bvh"]')
      .setInputFiles({ name: `${uploaded}.bvh`, mimeType: "text/plain", buffer: Buffer.from(createBowingBvh(64)) });
    await page.locator(".brand-piece", { hasText: uploaded }).waitFor({ state: "attached" });
    await waitForFirstPose(page);
    await playMotion(page, demo);
    const before = await graphicsMemory(page);
    await evaluateInEngine(page, () => void (globalThis.replaced = []));
    for (let nth = 0; nth < CHANGES; nth++) {
      await evaluateInEngine(page, () => {
        const { stage, viewer } = globalThis.bunraku;
        for (const object of [stage.puppet, viewer.figure]) if (object) globalThis.replaced.push(new WeakRef(object));
      });
      await playMotion(page, nth % 2 === 0 ? uploaded : demo);
    }
    expect(await evaluateInEngine(page, () => globalThis.replaced.length)).toBe(2 * CHANGES);
    expect(await graphicsMemory(page)).toEqual(before);
    await expect.poll(() => reachableCount(page, threads)).toBe(0);
  });
});

/** Play a motion of the library, found by a part of its name, and wait for its first pose. */
async function playMotion(page: Page, name: string): Promise<void> {
  await page.evaluate(
    (name) =>
      [...document.querySelectorAll<HTMLElement>(".motion")].find((item) => item.textContent?.includes(name))?.click(),
    name,
  );
  await page.locator(".brand-piece", { hasText: name }).waitFor({ state: "attached" });
  await waitForFirstPose(page);
}

/** Return three.js's counts of graphics objects after everything has been drawn. */
async function graphicsMemory(page: Page): Promise<Record<string, number>> {
  const frame = await evaluateInEngine(page, () => globalThis.bunraku.stage.renderer.info.render.frame);
  await waitInEngine(page, (frame) => globalThis.bunraku.stage.renderer.info.render.frame > frame + 1, frame);
  return evaluateInEngine(page, () => {
    const { memory, programs } = globalThis.bunraku.stage.renderer.info;
    return { ...memory, programs: programs?.length ?? 0 };
  });
}

/** Return the number of replaced objects that are still reachable after a garbage collection. */
async function reachableCount(page: Page, threads: readonly ThreadProtocol[]): Promise<number> {
  await collectGarbage(threads);
  return evaluateInEngine(page, () => globalThis.replaced.filter((reference) => reference.deref()).length);
}
