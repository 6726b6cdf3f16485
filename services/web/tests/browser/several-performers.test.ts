/** Several performers on one stage, in a real browser over the real server: added from the library, each taken by its own strings, on the page and in another site's. */
import type { Page } from "playwright-core";
import { afterAll, expect, test } from "vitest";
import { findViolations } from "./accessibility";
import { describeInBrowser, type OpenOptions } from "./browser-suite";
import { startForeignSite } from "./foreign-site";
import {
  LEFT_HAND,
  pauseAtStart,
  ringPosition,
  stopDrawing,
  tapKey,
  waitForDraw,
  waitForFirstPose,
  waitForHold,
  waitForPerformers,
  waitForRelease,
  waitForToast,
  waitForWelcome,
  waitUntilSettled,
} from "./page-probe";

/** Paused on entering, as less motion is asked for. */
const CALM: OpenOptions = { viewport: { width: 900, height: 560 }, reducedMotion: "reduce" };
/** The first limb of the second performer: its left hand. */
const SECOND = 4;

const site = await startForeignSite();
afterAll(() => site.stop());

describeInBrowser("several performers", { demo: true, origins: site.origin }, (own) => {
  async function open(name: string, address = ""): Promise<Page> {
    const page = await own.open(`${address}?name=${name}`, CALM);
    await waitForFirstPose(page);
    await waitForWelcome(page);
    return page;
  }

  test("a dance is added from the library; rings of all are taken by pointer, those of the chosen one by keys, and others see it", async () => {
    const page = await open("Aiko");
    const alone = await page.evaluate(() => window.bunraku.stage.audience.camera.position.toArray());
    expect(await page.locator(".next-dancer:visible, .dancers:visible").count()).toBe(0);
    await page.getByRole("button", { name: "Library", exact: true }).click();
    await add(page, "Sanbasō, First Steps");
    await waitForPerformers(page, 2);
    expect(await page.locator(".motion[aria-current]").innerText()).toContain("2 dancers");
    await page.getByRole("button", { name: "Close library" }).click();

    // both are in the picture, and equal ones share what they are made of
    const seen = await waitUntilSettled(page, () => sides(page), 0.01);
    expect(seen.left).toBeGreaterThan(-1);
    expect(seen.right).toBeLessThan(1);
    expect(seen.right - seen.left).toBeGreaterThan(0.5);
    expect(await page.evaluate(() => window.bunraku.stage.renderer.info.memory.geometries)).toBeLessThan(12);
    expect(await page.evaluate(() => window.bunraku.stage.audience.camera.position.toArray())).not.toEqual(alone);

    const mateo = await open("Mateo", new URL(page.url()).pathname);
    await waitForPerformers(mateo, 2);
    for (const one of [page, mateo]) {
      await pauseAtStart(one);
      // what is free for a moment, as its holder's page stood still, another would take
      await stopDrawing(one);
    }
    await page.getByRole("button", { name: "Strings", exact: true }).click();
    const second = page.getByRole("button", { name: /^Dancer 2/ });
    expect(await second.getAttribute("aria-pressed")).toBe("false");
    const ring = await waitUntilSettled(page, () => ringPosition(page, SECOND + LEFT_HAND), 0.5);
    await page.mouse.move(ring.x, ring.y);
    await page.mouse.down();
    await waitForHold(page, SECOND + LEFT_HAND);
    await expect.poll(() => second.getAttribute("aria-pressed")).toBe("true");
    await expect.poll(() => second.getAttribute("aria-label")).toBe("Dancer 2, left hand: You");
    const before = await wrists(mateo);
    await page.mouse.move(ring.x - 15, ring.y - 25, { steps: 3 });
    await page.mouse.move(ring.x - 30, ring.y - 60, { steps: 3 });
    await mateo.waitForFunction(([x, y, z]) => {
      const at = window.bunraku.stage.performers[1].joint("l_wrist").elements;
      return Math.hypot(at[12] - x, at[13] - y, at[14] - z) > 0.1;
    }, before[1]);
    expect((await wrists(mateo))[0]).toEqual(before[0]);
    await page.mouse.up();
    await waitForRelease(page, SECOND + LEFT_HAND);

    await tapKey(page, "Digit2");
    await waitForHold(page, SECOND + LEFT_HAND);
    await page.getByRole("button", { name: "Release left hand of dancer 2" }).waitFor();
    await waitForToast(mateo, "Dancer 2 of 2", () => mateo.keyboard.press("KeyT"));
    await waitForToast(mateo, "Aiko holds the left hand of dancer 2", () => tapKey(mateo, "Digit2"));
    await waitForToast(page, "Dancer 1 of 2", () => page.keyboard.press("KeyT"));
    await tapKey(page, "Digit2");
    await waitForHold(page, LEFT_HAND);
    await waitForHold(page, SECOND + LEFT_HAND);
    await waitForDraw(page);
    expect(await findViolations(page)).toEqual([]);
    await page.keyboard.press("Escape");
    await waitForRelease(page, LEFT_HAND);
    await waitForRelease(page, SECOND + LEFT_HAND);
  });

  test("four are the most, all of them in another site's page too", async () => {
    const page = await open("Aiko");
    await page.getByRole("button", { name: "Library", exact: true }).click();
    // the dance of two that was made before
    await waitForPerformers(page, 2);
    await add(page, "Sanbasō, First Steps × 2");
    await waitForPerformers(page, 4);
    await add(page, "Sanbasō, First Steps");
    await page.getByText("The stage is full").waitFor();

    const session = new URL(page.url()).searchParams.get("session") ?? "";
    site.html = `<!doctype html><title>Elsewhere</title><script type="module" src="${own.url}/embed/bunraku-stage.js"></script><bunraku-stage src="${own.url}/?session=${session}&name=Mateo" controls style="width: 420px"></bunraku-stage>`;
    const elsewhere = await own.open(site.origin, CALM);
    await elsewhere.waitForFunction(
      () =>
        document.querySelector("bunraku-stage")?.stage?.performers.filter(({ group }) => group.visible).length === 4,
    );
    await elsewhere.getByRole("button", { name: "Dancer 1 of 4: go to the next" }).click();
    await elsewhere.waitForFunction(() => document.querySelector("bunraku-stage")?.puppeteer?.id);
    await elsewhere.getByRole("button", { name: "Take the right leg of dancer 2" }).click();
    await page.waitForFunction((limb) => window.bunraku.viewer.presence?.limbs[limb] !== null, SECOND + 3);
  });
});

/** Presses "Add to the stage" in the row of the dance of this name. */
async function add(page: Page, name: string): Promise<void> {
  await page.getByRole("button", { name: `Add ${name} to the stage`, exact: true }).click();
}

/** How far to the sides heads are, -1 and 1 the edges of the picture. */
function sides(page: Page): Promise<{ left: number; right: number }> {
  return page.evaluate(() => {
    const { stage } = window.bunraku;
    const at = stage.performers.map(
      (one) =>
        stage.rig.group.position.clone().setFromMatrixPosition(one.joint("skullbase")).project(stage.audience.camera).x,
    );
    return { left: Math.min(...at), right: Math.max(...at) };
  });
}

/** World places of all performers' left wrists. */
function wrists(page: Page): Promise<[number, number, number][]> {
  return page.evaluate(() =>
    window.bunraku.stage.performers.map((one) => {
      const at = one.joint("l_wrist").elements;
      return [at[12], at[13], at[14]] as [number, number, number];
    }),
  );
}
