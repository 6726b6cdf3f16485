/** A file dropped on the page in a real browser. */
import type { Browser, Page } from "playwright-core";
import { afterAll, beforeAll, describe, expect, test } from "vitest";
import { bowing } from "./bowing";
import { launch } from "./chromium";
import { chromium, startServer, type RunningServer } from "./server";

const PATIENCE = 90_000;

/** Two seconds. */
const DANCE = bowing(60);

const path = chromium();
if (!path && process.env["CI"]) throw new Error("the browser tests must run in CI: install Chromium");
if (!path) console.warn("browser test of dropping skipped: Chromium is not installed");

describe.skipIf(!path)("a drop on the page", { timeout: 2 * PATIENCE }, () => {
  let server: RunningServer;
  let browser: Browser;
  let page: Page;

  beforeAll(async () => {
    [server, browser] = await Promise.all([startServer({ demo: false }), launch(path ?? "")]);
    // Small, as the picture is drawn in software.
    page = await browser.newPage({ viewport: { width: 500, height: 400 }, reducedMotion: "reduce" });
    page.setDefaultTimeout(PATIENCE);
    page.on("pageerror", (error) => {
      throw error;
    });
    await page.goto(server.url);
    await page.getByRole("complementary", { name: "Library" }).waitFor();
  }, PATIENCE);
  afterAll(async () => {
    await browser?.close();
    await server?.stop();
  }, PATIENCE);

  test("a file dropped anywhere on the page is uploaded and danced", async () => {
    await page.evaluate(drag, { type: "dragover", name: "dropped.bvh", text: DANCE });
    await page.locator(".drop-frame").waitFor();
    await page.evaluate(drag, { type: "drop", name: "dropped.bvh", text: DANCE });
    await page.locator(".drop-frame").waitFor({ state: "hidden" });
    await page.locator(".brand-piece", { hasText: "dropped" }).waitFor({ state: "attached" });
    expect(await page.locator(".problem").count()).toBe(0);
    const stored = await page.evaluate(async () => (await (await fetch("/v1/motions")).json()) as { items: { filename: string }[] });
    expect(stored.items.map(({ filename }) => filename)).toContain("dropped.bvh");
  });
});

/** In the page: a file over the stage or dropped on it, as the browser tells of it. */
function drag({ type, name, text }: { type: string; name: string; text: string }): void {
  const dataTransfer = new DataTransfer();
  dataTransfer.items.add(new File([text], name));
  const event = new DragEvent(type, { dataTransfer, bubbles: true, cancelable: true });
  document.querySelector("#stage")?.dispatchEvent(event);
  if (!event.defaultPrevented) throw new Error(`the browser would have opened the file: ${type} was not taken`);
}
