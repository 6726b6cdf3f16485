/** The page in a real browser over the real server: a clip goes in, the puppet moves, a pulled hand is seen by another. */
import { join } from "node:path";
import type { Browser, Page } from "playwright-core";
import { afterAll, beforeAll, describe, expect, onTestFinished, test } from "vitest";
import type { Stage } from "../../src/stage/stage";
import type { Puppeteer } from "../../src/client/puppeteer";
import type { Viewer } from "../../src/client/viewer";
import { launch } from "./chromium";
import { chromium, sharedFolder, startServer, type RunningServer } from "./server";

type Inside = { bunraku: { stage: Stage; viewer: Viewer; puppeteer: Puppeteer } };
type Place = [number, number, number];

const LEFT_HAND = 0;
const PATIENCE = 90_000;

const path = chromium();
const shared = sharedFolder();
const inCi = Boolean(process.env["CI"]);
if (!path && inCi) throw new Error("the browser tests must run in CI: install Chromium");
if (!path) console.warn("browser tests skipped: Chromium is not installed");
if (!shared && inCi) throw new Error("the browser test of a real clip must run in CI: set BUNRAKU_SHARED");
if (!shared) console.warn("browser test of a real clip skipped: no clips beside the project (BUNRAKU_SHARED)");

describe.skipIf(!path)("the page", { timeout: 2 * PATIENCE }, () => {
  let server: RunningServer;
  let browser: Browser;

  beforeAll(async () => {
    [server, browser] = await Promise.all([startServer({ demo: false }), launch(path ?? "")]);
  }, PATIENCE);
  afterAll(async () => {
    await browser?.close();
    await server?.stop();
  }, PATIENCE);

  async function open(url: string): Promise<Page> {
    // Small, as the picture is drawn in software.
    const page = await browser.newPage({ viewport: { width: 760, height: 480 }, colorScheme: "dark" });
    page.setDefaultTimeout(PATIENCE);
    page.on("pageerror", (error) => {
      throw error;
    });
    await page.goto(url);
    return page;
  }

  test("invites when the stage is empty, and says what is wrong with a file that is no dance", async () => {
    const page = await open(server.url);
    await page.getByRole("complementary", { name: "Library" }).waitFor();
    await page.locator("input[type=file]").setInputFiles({ name: "letter.bvh", mimeType: "text/plain", buffer: Buffer.from("Dear all,\n") });
    const problem = page.locator(".problem");
    await problem.waitFor();
    expect(await problem.innerText()).toContain("letter.bvh");
    expect(await page.locator(".motion").count()).toBe(0);
    await page.close();
  });

  test.skipIf(!shared)("takes a real clip, dances it, and shows one's pull to a second page", async () => {
    const page = await open(server.url);
    await page.locator("input[type=file]").setInputFiles(join(shared ?? "", "mocap/bvh/perfume_A.bvh"));
    await danced(page);
    expect(await page.locator(".brand-piece").innerText()).toBe("perfume_A");
    expect(await page.locator(".problem").count()).toBe(0);
    expect(await page.getByRole("button", { name: "Pause" }).isVisible()).toBe(true);
    await page.getByRole("button", { name: "Close library" }).click();

    const before = await place(page, "r_wrist");
    await moved(page, "r_wrist", before, 0.1, Infinity);
    const picture = await page.screenshot();
    expect(picture.length).toBeGreaterThan(20_000);

    // The address is the session's: whoever has it sees the same stage.
    expect(new URL(page.url()).searchParams.get("session")).toBeTruthy();
    const second = await open(page.url());
    await danced(second);

    // Pause, so that only the pull moves the hand.
    await page.getByRole("button", { name: "Pause" }).click();
    await second.getByRole("button", { name: "Play", exact: true }).waitFor();
    const danceAt = await settled(second, "l_wrist");

    const ring = await ringOf(page, LEFT_HAND);
    await page.mouse.move(ring.x, ring.y);
    await page.mouse.down();
    await page.mouse.move(ring.x + 30, ring.y - 60, { steps: 3 });
    await page.mouse.move(ring.x + 60, ring.y - 120, { steps: 3 });
    await page.waitForFunction((limb) => (window as unknown as Inside).bunraku.puppeteer.holds(limb), LEFT_HAND);
    await second.waitForFunction((limb) => Boolean((window as unknown as Inside).bunraku.viewer.presence?.limbs[limb]), LEFT_HAND);
    await moved(second, "l_wrist", danceAt, 0.15, Infinity);
    // Both pages show the hand in one place, to a few centimetres of blending under way.
    const [mine, theirs] = [await settled(page, "l_wrist"), await settled(second, "l_wrist")];
    expect(Math.hypot(mine[0] - theirs[0], mine[1] - theirs[1], mine[2] - theirs[2])).toBeLessThan(0.06);
    expect(await second.getByRole("button", { name: /^Left hand, held by/ }).isVisible()).toBe(true);

    // Let go: the dance has the hand back.
    await page.mouse.up();
    await second.getByRole("button", { name: "Take the left hand" }).waitFor();
    await moved(second, "l_wrist", danceAt, 0, 0.02);
    await second.close();
    await page.close();
  });

  test("does everything by keyboard alone", async () => {
    const own = await startServer({ demo: true });
    onTestFinished(() => own.stop());
    const page = await open(own.url);
    await danced(page);
    await page.keyboard.press("Space");
    await page.getByRole("button", { name: "Play", exact: true }).waitFor();
    await page.keyboard.press("KeyN");
    await page.getByRole("complementary", { name: "Line" }).getByText("kbit/s").waitFor();
    await page.keyboard.press("Escape");
    await page.getByRole("complementary", { name: "Line" }).waitFor({ state: "hidden" });

    await page.keyboard.press("Digit2");
    await page.getByRole("button", { name: "Release the left hand" }).waitFor();
    await page.waitForFunction((limb) => (window as unknown as Inside).bunraku.puppeteer.holds(limb), LEFT_HAND);
    const from = await settled(page, "l_wrist");
    // Wherever the dance stood still, there is room towards the shoulder's height.
    const key = from[1] < (await place(page, "l_shoulder"))[1] ? "KeyW" : "KeyS";
    await page.keyboard.down(key);
    await moved(page, "l_wrist", from, 0.1, Infinity);
    await page.keyboard.up(key);
    await page.keyboard.press("Escape");
    await page.getByRole("button", { name: "Take the left hand" }).waitFor();
    await page.close();
  });
});

/** Waits for the first pose on the stage. */
async function danced(page: Page): Promise<void> {
  await page.waitForFunction(() => (window as unknown as Partial<Inside>).bunraku?.stage?.puppet?.group.visible ?? false);
}

/** World place of a joint, metres. */
function place(page: Page, joint: string): Promise<Place> {
  return page.evaluate((name) => {
    const at = (window as unknown as Inside).bunraku.stage.scene.getObjectByName(name)?.matrixWorld.elements;
    if (!at) throw new Error(`no ${name} on the stage`);
    return [at[12], at[13], at[14]] as [number, number, number];
  }, joint);
}

/** Waits until a joint is so far from a place, metres. */
async function moved(page: Page, joint: string, from: Place, least: number, most: number): Promise<void> {
  await page.waitForFunction(
    ({ joint, from, least, most }) => {
      const at = (window as unknown as Inside).bunraku.stage.scene.getObjectByName(joint)?.matrixWorld.elements;
      if (!at) return false;
      const away = Math.hypot(at[12] - from[0], at[13] - from[1], at[14] - from[2]);
      return away >= least && away <= most;
    },
    { joint, from, least, most: Math.min(most, Number.MAX_VALUE) },
  );
}

/** As `place`, once three frames running have shown the same. */
async function settled(page: Page, joint: string): Promise<Place> {
  let last = await place(page, joint);
  for (let same = 0; same < 3; ) {
    await page.evaluate(() => new Promise((drawn) => requestAnimationFrame(() => requestAnimationFrame(drawn))));
    const now = await place(page, joint);
    same = Math.hypot(now[0] - last[0], now[1] - last[1], now[2] - last[2]) < 0.002 ? same + 1 : 0;
    last = now;
  }
  return last;
}

/** Where a limb's ring is on the screen, pixels. */
function ringOf(page: Page, limb: number): Promise<{ x: number; y: number }> {
  return page.evaluate((index) => {
    const { stage } = (window as unknown as Inside).bunraku;
    if (!stage.puppet) throw new Error("no puppet on the stage");
    const at = stage.rig.group.position.clone();
    return stage.toScreen(stage.puppet.handle(index, at));
  }, limb);
}
