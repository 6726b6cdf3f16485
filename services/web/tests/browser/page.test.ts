/** The page: upload, playback, control of a hand that a second page shows, and the keyboard. */
import { join } from "node:path";
import type { Page } from "playwright-core";
import { expect, test } from "vitest";
import { describeInBrowser, type OpenOptions } from "./browser-suite";
import { evaluateInEngine, waitInEngine } from "./engine-probe";
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
import { sharedClipFolder } from "./server";

const DARK: OpenOptions = { colorScheme: "dark" };

const shared = sharedClipFolder();
if (!shared && process.env["CI"])
  throw new Error("No recorded clips found. Their browser test must run in CI: set BUNRAKU_SHARED.");
if (!shared) console.warn("browser test of a recorded clip skipped: no clips found (set BUNRAKU_SHARED)");

describeInBrowser("page of an empty server", { server: "empty" }, ({ open }) => {
  test("an empty stage opens the library, and a wrong file shows the problem", async () => {
    const page = await open("", DARK);
    await page.getByRole("complementary", { name: "Library" }).waitFor();
    await page
      .locator('input[type=file][accept*=".bvh"]')
      .setInputFiles({ name: "letter.bvh", mimeType: "text/plain", buffer: Buffer.from("Dear all,\n") });
    const problem = page.locator(".problem");
    await problem.waitFor();
    expect(await problem.innerText()).toContain("letter.bvh");
    expect(await page.locator(".motion").count()).toBe(0);
  });

  test.skipIf(!shared)("a recorded clip is played, and a second page shows the controlled hand", async () => {
    const page = await open("", DARK);
    await page.locator('input[type=file][accept*=".bvh"]').setInputFiles(join(shared ?? "", "mocap/bvh/perfume_A.bvh"));
    await waitForFirstPose(page);
    expect(await page.locator(".brand-piece").innerText()).toBe("perfume_A");
    expect(await page.locator(".problem").count()).toBe(0);
    expect(await page.getByRole("button", { name: "Pause" }).isVisible()).toBe(true);
    // The clip has a spine, a neck and clavicles.
    await waitInEngine(page, () => Boolean(globalThis.bunraku.viewer.poseAt(performance.now())?.extended));
    await page.getByRole("button", { name: "Close library" }).click();

    const before = await jointPosition(page, "r_wrist");
    await waitForDistance(page, "r_wrist", before, 0.1, Infinity);
    const picture = await page.screenshot();
    expect(picture.length).toBeGreaterThan(20_000);

    // The URL contains the session: everyone who opens it sees the same stage.
    expect(new URL(page.url()).searchParams.get("session")).toBeTruthy();
    const second = await open(page.url(), DARK);
    await waitForFirstPose(second);

    // Pause, so that only the puppeteer moves the hand.
    await page.getByRole("button", { name: "Pause" }).click();
    await second.getByRole("button", { name: "Play", exact: true }).waitFor();
    for (const viewer of [page, second]) await pauseAtStart(viewer);
    const motionPosition = await settledPosition(second, "l_wrist");

    const ring = await waitUntilSettled(page, () => ringPosition(page, LEFT_HAND), 0.5);
    const drag = (await canMoveUp(page, motionPosition)) ? -120 : 120;
    await page.mouse.move(ring.x, ring.y);
    await page.mouse.down();
    await page.mouse.move(ring.x + 30, ring.y + drag / 2, { steps: 3 });
    await page.mouse.move(ring.x + 60, ring.y + drag, { steps: 3 });
    await waitForHold(page, LEFT_HAND);
    await waitInEngine(second, (limb) => Boolean(globalThis.bunraku.viewer.presence?.limbs[limb]), LEFT_HAND);
    await waitForDistance(second, "l_wrist", motionPosition, 0.15, Infinity);
    // Both pages show the hand at the same position, within 6 cm of unfinished blending.
    await waitForDistance(second, "l_wrist", await settledPosition(page, "l_wrist"), 0, 0.06);
    await second.getByRole("button", { name: /^Left hand, held by/ }).waitFor();

    // After the release the hand returns to the motion.
    await page.mouse.up();
    await second.getByRole("button", { name: "Take the left hand" }).waitFor();
    await waitForDistance(second, "l_wrist", motionPosition, 0, 0.02);
  });
});

describeInBrowser("page", { server: "open" }, ({ open }) => {
  test("all functions work by keyboard alone", async () => {
    const page = await open("", DARK);
    await waitForFirstPose(page);
    await page.keyboard.press("Space");
    await page.getByRole("button", { name: "Play", exact: true }).waitFor();
    await pauseAtStart(page);
    await waitInEngine(page, () => globalThis.bunraku.stage.hasMotionCamera);
    const wasFollowing = await evaluateInEngine(page, () => globalThis.bunraku.stage.followsMotionCamera);
    await page.keyboard.press("KeyC");
    await waitInEngine(
      page,
      (wasFollowing) => globalThis.bunraku.stage.followsMotionCamera === !wasFollowing,
      wasFollowing,
    );
    await page.getByRole("button", { name: "Show's camera", pressed: !wasFollowing }).waitFor();
    await page.keyboard.press("KeyN");
    await page.getByRole("complementary", { name: "Connection" }).getByText("kbit/s").waitFor();
    await page.keyboard.press("Escape");
    await page.getByRole("complementary", { name: "Connection" }).waitFor({ state: "hidden" });

    await tapKey(page, "Digit2");
    await page.getByRole("button", { name: "Release the left hand" }).waitFor();
    await waitForHold(page, LEFT_HAND);
    const from = await settledPosition(page, "l_wrist");
    await page.keyboard.down("KeyW");
    await waitForDistance(page, "l_wrist", from, 0.1, Infinity);
    await page.keyboard.up("KeyW");
    await page.keyboard.press("Escape");
    await page.getByRole("button", { name: "Take the left hand" }).waitFor();
  });
});

/** Wait until a joint's distance from `origin` is between `minimum` and `maximum`, in metres. */
async function waitForDistance(
  page: Page,
  joint: string,
  origin: Position,
  minimum: number,
  maximum: number,
): Promise<void> {
  await waitInEngine(
    page,
    ({ joint, origin, minimum, maximum }) => {
      const at = globalThis.bunraku.stage.scene.getObjectByName(joint)?.matrixWorld.elements;
      if (!at) return false;
      const distance = Math.hypot(at[12] - origin[0], at[13] - origin[1], at[14] - origin[2]);
      return distance >= minimum && distance <= maximum;
    },
    { joint, origin, minimum, maximum: Math.min(maximum, Number.MAX_VALUE) },
  );
}

/** Return whether the left hand can be moved upwards: every hand below its shoulder can. */
async function canMoveUp(page: Page, wrist: Position): Promise<boolean> {
  return wrist[1] < (await jointPosition(page, "l_shoulder"))[1];
}

/** Return a joint's position once it does not move, in metres. */
function settledPosition(page: Page, joint: string): Promise<Position> {
  return waitUntilSettled(page, () => jointPosition(page, joint), 0.002);
}
