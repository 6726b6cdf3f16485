/** The page in a real browser over the real server: a clip goes in, the puppet moves, a pulled hand is seen by another. */
import { existsSync } from "node:fs";
import { join, resolve } from "node:path";
import type { Browser, Page } from "playwright-core";
import { afterAll, beforeAll, describe, expect, test } from "vitest";
import type { Stage } from "../../src/stage/stage";
import type { Puppeteer } from "../../src/client/puppeteer";
import type { Viewer } from "../../src/client/viewer";
import { chromiumPath, launch } from "./chromium";
import { startServer, whyNoServer, type RunningServer } from "./server";

type Inside = { bunraku: { stage: Stage; viewer: Viewer; puppeteer: Puppeteer } };
type Place = [number, number, number];

const SHARED = process.env.BUNRAKU_SHARED ?? resolve(import.meta.dirname, "../../../../../shared");
const CLIP = join(SHARED, "mocap/bvh/perfume_A.bvh");
const LEFT_HAND = 0;
const PATIENCE = 90_000;

const missing = chromiumPath() === null ? "Chromium is not installed" : whyNoServer();
const inCi = Boolean(process.env.CI);
if (missing && inCi) throw new Error(`the browser tests must run in CI: ${missing}`);
if (missing) console.warn(`browser tests skipped: ${missing}`);

describe.skipIf(missing !== null)("the page", { timeout: 2 * PATIENCE }, () => {
  let server: RunningServer;
  let browser: Browser;

  beforeAll(async () => {
    [server, browser] = await Promise.all([startServer(), launch()]);
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

  test.skipIf(!existsSync(CLIP) && !inCi)("takes a real clip, dances it, and shows one's pull to a second page", async () => {
    const page = await open(server.url);
    await page.locator("input[type=file]").setInputFiles(CLIP);
    await danced(page);
    expect(await page.locator(".brand-piece").innerText()).toBe("perfume_A");
    expect(await page.locator(".problem").count()).toBe(0);
    expect(await page.getByRole("button", { name: "Pause" }).isVisible()).toBe(true);
    await page.getByRole("button", { name: "Close library" }).click();

    const before = await place(page, "r_wrist");
    await page.waitForFunction(
      ([name, [x, y, z]]) => {
        const at = (window as unknown as Inside).bunraku.stage.scene.getObjectByName(name as string)?.matrixWorld.elements ?? [];
        const [a, b, c] = [at[12] - Number(x), at[13] - Number(y), at[14] - Number(z)];
        return Math.hypot(a, b, c) > 0.1;
      },
      ["r_wrist", before] as const,
    );
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
    await second.waitForFunction(
      ([x, y, z]) => {
        const at = (window as unknown as Inside).bunraku.stage.scene.getObjectByName("l_wrist")?.matrixWorld.elements ?? [];
        return Math.hypot(at[12] - x, at[13] - y, at[14] - z) > 0.15;
      },
      danceAt,
    );
    // Both pages show the hand in one place, to a few centimetres of blending under way.
    const [mine, theirs] = [await settled(page, "l_wrist"), await settled(second, "l_wrist")];
    expect(Math.hypot(mine[0] - theirs[0], mine[1] - theirs[1], mine[2] - theirs[2])).toBeLessThan(0.06);
    expect(await second.getByRole("button", { name: /^Left hand, held by/ }).isVisible()).toBe(true);

    // Let go: the dance has the hand back.
    await page.mouse.up();
    await second.getByRole("button", { name: "Take the left hand" }).waitFor();
    await second.waitForFunction(
      ([x, y, z]) => {
        const at = (window as unknown as Inside).bunraku.stage.scene.getObjectByName("l_wrist")?.matrixWorld.elements ?? [];
        return Math.hypot(at[12] - x, at[13] - y, at[14] - z) < 0.02;
      },
      danceAt,
    );
    await second.close();
    await page.close();
  });

  test.skipIf(!existsSync(CLIP) && !inCi)("does everything by keyboard alone", async () => {
    const page = await open(server.url);
    await danced(page);
    await page.keyboard.press("Space");
    await page.getByRole("button", { name: /^(Play|Pause)$/ }).waitFor();
    await page.keyboard.press("KeyN");
    await page.getByRole("complementary", { name: "Line" }).getByText("kbit/s").waitFor();
    await page.keyboard.press("Escape");
    await page.getByRole("complementary", { name: "Line" }).waitFor({ state: "hidden" });

    await page.keyboard.press("Digit2");
    await page.getByRole("button", { name: "Release the left hand" }).waitFor();
    await page.waitForFunction((limb) => (window as unknown as Inside).bunraku.puppeteer.holds(limb), LEFT_HAND);
    const from = await settled(page, "l_wrist");
    await page.keyboard.down("KeyE");
    await page.waitForFunction(
      ([x, y, z]) => {
        const at = (window as unknown as Inside).bunraku.stage.scene.getObjectByName("l_wrist")?.matrixWorld.elements ?? [];
        return Math.hypot(at[12] - x, at[13] - y, at[14] - z) > 0.1;
      },
      from,
    );
    await page.keyboard.up("KeyE");
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
