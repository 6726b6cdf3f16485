/** The page in a real browser over the real server: a clip goes in, the puppet moves, a pulled hand is seen by another. */
import { join } from "node:path";
import type { Page } from "playwright-core";
import { expect, onTestFinished, test } from "vitest";
import { describeInBrowser, type OpenOptions } from "./browser-suite";
import {
  jointPosition,
  LEFT_HAND,
  type Position,
  pauseAtStart,
  ringPosition,
  tapKey,
  waitForFirstPose,
  waitForHold,
  waitUntilSettled,
} from "./page-probe";
import { sharedClipFolder, startServer } from "./server";

const NIGHT: OpenOptions = { colorScheme: "dark" };

const shared = sharedClipFolder();
if (!shared && process.env["CI"]) throw new Error("the browser test of a real clip must run in CI: set BUNRAKU_SHARED");
if (!shared) console.warn("browser test of a real clip skipped: no clips beside the project (BUNRAKU_SHARED)");

describeInBrowser("the page", {}, ({ open }) => {
  test("invites when the stage is empty, and says what is wrong with a file that is no dance", async () => {
    const page = await open("", NIGHT);
    await page.getByRole("complementary", { name: "Library" }).waitFor();
    await page
      .locator('input[type=file][accept*=".bvh"]')
      .setInputFiles({ name: "letter.bvh", mimeType: "text/plain", buffer: Buffer.from("Dear all,\n") });
    const problem = page.locator(".problem");
    await problem.waitFor();
    expect(await problem.innerText()).toContain("letter.bvh");
    expect(await page.locator(".motion").count()).toBe(0);
  });

  test.skipIf(!shared)("takes a real clip, dances it, and shows one's pull to a second page", async () => {
    const page = await open("", NIGHT);
    await page.locator('input[type=file][accept*=".bvh"]').setInputFiles(join(shared ?? "", "mocap/bvh/perfume_A.bvh"));
    await waitForFirstPose(page);
    expect(await page.locator(".brand-piece").innerText()).toBe("perfume_A");
    expect(await page.locator(".problem").count()).toBe(0);
    expect(await page.getByRole("button", { name: "Pause" }).isVisible()).toBe(true);
    await page.getByRole("button", { name: "Close library" }).click();

    const before = await jointPosition(page, "r_wrist");
    await moved(page, "r_wrist", before, 0.1, Infinity);
    const picture = await page.screenshot();
    expect(picture.length).toBeGreaterThan(20_000);

    // The address is the session's: whoever has it sees the same stage.
    expect(new URL(page.url()).searchParams.get("session")).toBeTruthy();
    const second = await open(page.url(), NIGHT);
    await waitForFirstPose(second);

    // Pause, so that only the pull moves the hand.
    await page.getByRole("button", { name: "Pause" }).click();
    await second.getByRole("button", { name: "Play", exact: true }).waitFor();
    for (const one of [page, second]) await pauseAtStart(one);
    const danceAt = await standing(second, "l_wrist");

    const ring = await waitUntilSettled(page, () => ringPosition(page, LEFT_HAND), 0.5);
    const pull = (await upHasRoom(page, danceAt)) ? -120 : 120;
    await page.mouse.move(ring.x, ring.y);
    await page.mouse.down();
    await page.mouse.move(ring.x + 30, ring.y + pull / 2, { steps: 3 });
    await page.mouse.move(ring.x + 60, ring.y + pull, { steps: 3 });
    await waitForHold(page, LEFT_HAND);
    await second.waitForFunction((limb) => Boolean(window.bunraku.viewer.presence?.limbs[limb]), LEFT_HAND);
    await moved(second, "l_wrist", danceAt, 0.15, Infinity);
    // Both pages show the hand in one place, to a few centimetres of blending under way.
    await moved(second, "l_wrist", await standing(page, "l_wrist"), 0, 0.06);
    await second.getByRole("button", { name: /^Left hand, held by/ }).waitFor();

    // Let go: the dance has the hand back.
    await page.mouse.up();
    await second.getByRole("button", { name: "Take the left hand" }).waitFor();
    await moved(second, "l_wrist", danceAt, 0, 0.02);
  });

  test("does everything by keyboard alone", async () => {
    const own = await startServer({ demo: true });
    onTestFinished(() => own.stop());
    const page = await open(own.url, NIGHT);
    await waitForFirstPose(page);
    await page.keyboard.press("Space");
    await page.getByRole("button", { name: "Play", exact: true }).waitFor();
    await pauseAtStart(page);
    await page.waitForFunction(() => window.bunraku.stage.hasMotionCamera);
    const followed = await page.evaluate(() => window.bunraku.stage.followsMotionCamera);
    await page.keyboard.press("KeyC");
    await page.waitForFunction((followed) => window.bunraku.stage.followsMotionCamera === !followed, followed);
    await page.getByRole("button", { name: "Show's camera", pressed: !followed }).waitFor();
    await page.keyboard.press("KeyN");
    await page.getByRole("complementary", { name: "Connection" }).getByText("kbit/s").waitFor();
    await page.keyboard.press("Escape");
    await page.getByRole("complementary", { name: "Connection" }).waitFor({ state: "hidden" });

    await tapKey(page, "Digit2");
    await page.getByRole("button", { name: "Release the left hand" }).waitFor();
    await waitForHold(page, LEFT_HAND);
    const from = await standing(page, "l_wrist");
    await page.keyboard.down("KeyW");
    await moved(page, "l_wrist", from, 0.1, Infinity);
    await page.keyboard.up("KeyW");
    await page.keyboard.press("Escape");
    await page.getByRole("button", { name: "Take the left hand" }).waitFor();
  });
});

/** Waits until a joint is so far from a place, metres. */
async function moved(page: Page, joint: string, from: Position, least: number, most: number): Promise<void> {
  await page.waitForFunction(
    ({ joint, from, least, most }) => {
      const at = window.bunraku.stage.scene.getObjectByName(joint)?.matrixWorld.elements;
      if (!at) return false;
      const away = Math.hypot(at[12] - from[0], at[13] - from[1], at[14] - from[2]);
      return away >= least && away <= most;
    },
    { joint, from, least, most: Math.min(most, Number.MAX_VALUE) },
  );
}

/** Whether the left hand, whose wrist is there, has room upwards: however a clip begins, it has some towards the shoulder's height. */
async function upHasRoom(page: Page, wrist: Position): Promise<boolean> {
  return wrist[1] < (await jointPosition(page, "l_shoulder"))[1];
}

/** Where a joint is once it stands still, metres. */
function standing(page: Page, joint: string): Promise<Position> {
  return waitUntilSettled(page, () => jointPosition(page, joint), 0.002);
}
