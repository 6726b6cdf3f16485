/** The page's engine, in a worker and in the page. */
import type { Page } from "playwright-core";
import { expect, test } from "vitest";
import { describeInBrowser } from "./browser-suite";
import { engineOf, engineWorker, evaluateInEngine, waitForFrames } from "./engine-probe";
import {
  jointPosition,
  LEFT_HAND,
  pauseAtStart,
  ringPosition,
  tapKey,
  waitForFirstPose,
  waitForHold,
  waitForRelease,
  waitForWelcome,
  waitUntilSettled,
} from "./page-probe";

/** Least movement of a pulled hand, in metres. */
const MIN_MOVEMENT_M = 0.1;
/** Frames of the engine, times two, in which a still stage is observed. */
const STILL_FRAMES = 10;

describeInBrowser("engine", { server: "open" }, ({ open }) => {
  /** Pull the left hand by the mouse, then hold it by its key. */
  async function pullHand(page: Page): Promise<void> {
    await pauseAtStart(page);
    const ring = await waitUntilSettled(page, () => ringPosition(page, LEFT_HAND), 0.5);
    const [, from] = await jointPosition(page, "l_wrist");
    await page.mouse.move(ring.x, ring.y);
    await page.mouse.down();
    await page.mouse.move(ring.x + 20, ring.y - 60, { steps: 4 });
    await expect
      .poll(async () => (await jointPosition(page, "l_wrist"))[1] - from, { timeout: 60_000 })
      .toBeGreaterThan(MIN_MOVEMENT_M);
    await page.mouse.up();
    await waitForRelease(page, LEFT_HAND);
    await tapKey(page, "Digit2");
    await waitForHold(page, LEFT_HAND);
    await page.keyboard.press("Escape");
    await waitForRelease(page, LEFT_HAND);
  }

  test("it runs in a worker: the page draws nothing itself", async () => {
    const page = await open();
    await waitForFirstPose(page);
    await waitForWelcome(page);
    expect(await engineOf(page)).toBe(engineWorker(page));
    expect(await page.evaluate(() => Object.keys(globalThis.bunraku))).toEqual(["listening"]);
    expect(await evaluateInEngine(page, () => "document" in globalThis)).toBe(false);
    await pullHand(page);
  });

  test("a page whose stage stands still requests no frames", async () => {
    const page = await open();
    await waitForFirstPose(page);
    await waitForWelcome(page);
    await pauseAtStart(page);
    await page.locator(".invitation").waitFor({ state: "hidden" });
    await page.evaluate(() => {
      const request = requestAnimationFrame.bind(window);
      document.documentElement.dataset["requests"] = "0";
      window.requestAnimationFrame = (callback) => {
        document.documentElement.dataset["requests"] = String(Number(document.documentElement.dataset["requests"]) + 1);
        return request(callback);
      };
    });
    const requestCount = () => page.evaluate(() => Number(document.documentElement.dataset["requests"]));
    const worker = await engineOf(page);
    const countInFrames = async () => {
      const before = await requestCount();
      for (let frame = 0; frame < STILL_FRAMES; frame++) await waitForFrames(worker);
      return (await requestCount()) - before;
    };
    // The camera and the puppet's cloth come to rest after the pause.
    await expect.poll(countInFrames).toBe(0);
    await page.getByRole("button", { name: "Play", exact: true }).click();
    await expect.poll(requestCount).toBeGreaterThan(0);
  });

  test("it runs in the page where a canvas cannot be given to a worker", async () => {
    const page = await open("", {
      before: (page) =>
        page.addInitScript(() => {
          Reflect.deleteProperty(HTMLCanvasElement.prototype, "transferControlToOffscreen");
        }),
    });
    await waitForFirstPose(page);
    await waitForWelcome(page);
    expect([await engineOf(page), page.workers()]).toEqual([page, []]);
    await pullHand(page);
  });

  test("it runs in the page where WebGL needs a canvas element", async () => {
    const page = await open("", {
      before: async (page) => {
        await page.addInitScript(removeOffscreenGraphics);
        await page.route("**/assets/main-*.js", async (route) => {
          const response = await route.fetch();
          await route.fulfill({ response, body: `(${removeOffscreenGraphics})();\n${await response.text()}` });
        });
      },
    });
    await waitForFirstPose(page);
    await waitForWelcome(page);
    expect([await engineOf(page), page.workers()]).toEqual([page, []]);
  });
});

/** In a realm before its scripts: offer no graphics context on canvases that are no elements. */
function removeOffscreenGraphics(): void {
  OffscreenCanvas.prototype.getContext = () => null;
}
