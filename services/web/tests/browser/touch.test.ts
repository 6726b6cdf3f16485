/** A ring dragged by touch in a real browser. */
import type { Browser, Page } from "playwright-core";
import { afterAll, beforeAll, describe, test } from "vitest";
import type { Puppeteer } from "../../src/client/puppeteer";
import type { Hands } from "../../src/input/hands";
import type { Stage } from "../../src/stage/stage";
import { launch } from "./chromium";
import { chromium, startServer, type RunningServer } from "./server";

type Inside = { bunraku: { stage: Stage; hands: Hands; puppeteer: Puppeteer | null } };

const LEFT_HAND = 0;
const PATIENCE = 90_000;

const path = chromium();
if (!path && process.env["CI"]) throw new Error("the browser tests must run in CI: install Chromium");
if (!path) console.warn("browser test of touch skipped: Chromium is not installed");

describe.skipIf(!path)("a finger on the page", { timeout: 2 * PATIENCE }, () => {
  let server: RunningServer;
  let browser: Browser;
  let page: Page;

  beforeAll(async () => {
    [server, browser] = await Promise.all([startServer({ demo: true }), launch(path ?? "")]);
    // A small phone: there the limbs' buttons stand below the hands wherever the dance is paused.
    page = await browser.newPage({ viewport: { width: 360, height: 640 }, hasTouch: true, reducedMotion: "reduce" });
    page.setDefaultTimeout(PATIENCE);
    page.on("pageerror", (error) => {
      throw error;
    });
    await page.goto(server.url);
    await page.waitForFunction(() => (window as unknown as Partial<Inside>).bunraku?.stage?.puppet?.group.visible ?? false);
  }, PATIENCE);
  afterAll(async () => {
    await browser?.close();
    await server?.stop();
  }, PATIENCE);

  test("a finger on a ring pulls the hand, and lifted gives it back", async () => {
    // Paused on entering, as less motion is asked for: only the finger moves the hand.
    await page.getByRole("button", { name: "Play", exact: true }).waitFor();
    await page.waitForFunction(() => (window as unknown as Inside).bunraku.puppeteer?.id != null);
    const ring = await ringOf(page);
    const touch = await page.context().newCDPSession(page);
    const finger = (type: "touchStart" | "touchMove", x: number, y: number) =>
      touch.send("Input.dispatchTouchEvent", { type, touchPoints: [{ x: ring.x + x, y: ring.y + y }] });
    await finger("touchStart", 0, 0);
    await page.getByRole("button", { name: "Release the left hand" }).waitFor({ state: "attached" });
    for (const step of [1, 2, 3, 4]) await finger("touchMove", 6 * step, -12 * step);
    // The ring follows the finger over the screen.
    await page.waitForFunction(
      ({ limb, from }) => {
        const { stage, hands } = (window as unknown as Inside).bunraku;
        const at = stage.puppet && stage.toScreen(stage.puppet.handle(limb, stage.rig.group.position.clone()));
        return hands.source(limb) === "pointer" && at !== null && at.y < from.y - 20;
      },
      { limb: LEFT_HAND, from: ring },
    );
    await touch.send("Input.dispatchTouchEvent", { type: "touchEnd", touchPoints: [] });
    await page.getByRole("button", { name: "Take the left hand" }).waitFor({ state: "attached" });
    await page.waitForFunction((limb) => (window as unknown as Inside).bunraku.hands.source(limb) === null, LEFT_HAND);
  });
});

/** Where the left hand's ring is on the screen once the pause has taken effect and nothing moves any more, pixels. */
async function ringOf(page: Page): Promise<{ x: number; y: number }> {
  let last = { x: Infinity, y: Infinity };
  for (let same = 0; same < 5; ) {
    const now = await page.evaluate(async (limb) => {
      await new Promise((drawn) => requestAnimationFrame(() => requestAnimationFrame(drawn)));
      const { stage } = (window as unknown as Inside).bunraku;
      if (!stage.puppet) throw new Error("no puppet on the stage");
      return stage.toScreen(stage.puppet.handle(limb, stage.rig.group.position.clone()));
    }, LEFT_HAND);
    same = Math.hypot(now.x - last.x, now.y - last.y) < 0.5 ? same + 1 : 0;
    last = now;
  }
  return last;
}
