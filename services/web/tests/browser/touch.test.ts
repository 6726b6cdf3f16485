/** Control of a limb by touch. */
import { test } from "vitest";
import { describeInBrowser } from "./browser-suite";
import { waitInEngine } from "./engine-probe";
import {
  LEFT_HAND,
  pauseAtStart,
  ringPosition,
  waitForFirstPose,
  waitForRelease,
  waitForWelcome,
  waitUntilSettled,
} from "./page-probe";

describeInBrowser("touch", { server: "open" }, ({ open }) => {
  test("dragging a ring moves the hand, and lifting the finger releases it", async () => {
    // On a small phone the limbs' buttons are below the hands.
    const page = await open("", { viewport: { width: 360, height: 640 }, hasTouch: true, reducedMotion: "reduce" });
    await waitForFirstPose(page);
    // With reduced motion the session is paused: only the finger moves the hand.
    await page.getByRole("button", { name: "Play", exact: true }).waitFor();
    await waitForWelcome(page);
    await pauseAtStart(page);
    const ring = await waitUntilSettled(page, () => ringPosition(page, LEFT_HAND), 0.5);
    const protocol = await page.context().newCDPSession(page);
    const sendTouch = (type: "touchStart" | "touchMove", x: number, y: number) =>
      protocol.send("Input.dispatchTouchEvent", { type, touchPoints: [{ x: ring.x + x, y: ring.y + y }] });
    await sendTouch("touchStart", 0, 0);
    await page.getByRole("button", { name: "Release the left hand" }).waitFor({ state: "attached" });
    for (const step of [1, 2, 3, 4]) await sendTouch("touchMove", 6 * step, -12 * step);
    // The ring follows the finger.
    await waitInEngine(
      page,
      ({ limb, from }) => {
        const { stage, hands } = globalThis.bunraku;
        const at = stage.puppet && stage.toScreen(stage.puppet.handle(limb, stage.rig.group.position.clone()));
        return hands.source(limb) === "pointer" && at !== null && at.y < from.y - 20;
      },
      { limb: LEFT_HAND, from: ring },
    );
    await protocol.send("Input.dispatchTouchEvent", { type: "touchEnd", touchPoints: [] });
    await page.getByRole("button", { name: "Take the left hand" }).waitFor({ state: "attached" });
    await waitForRelease(page, LEFT_HAND);
  });
});
