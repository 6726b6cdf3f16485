/** A ring dragged by touch in a real browser. */
import { test } from "vitest";
import { describeInBrowser } from "./browser-suite";
import {
  LEFT_HAND,
  pauseAtStart,
  ringPosition,
  waitForFirstPose,
  waitForRelease,
  waitForWelcome,
  waitUntilSettled,
} from "./page-probe";

describeInBrowser("a finger on the page", { demo: true }, ({ open }) => {
  test("a finger on a ring pulls the hand, and lifted gives it back", async () => {
    // A small phone: there the limbs' buttons stand below the hands.
    const page = await open("", { viewport: { width: 360, height: 640 }, hasTouch: true, reducedMotion: "reduce" });
    await waitForFirstPose(page);
    // Paused on entering, as less motion is asked for: only the finger moves the hand.
    await page.getByRole("button", { name: "Play", exact: true }).waitFor();
    await waitForWelcome(page);
    await pauseAtStart(page);
    // once nothing moves any more
    const ring = await waitUntilSettled(page, () => ringPosition(page, LEFT_HAND), 0.5);
    const touch = await page.context().newCDPSession(page);
    const finger = (type: "touchStart" | "touchMove", x: number, y: number) =>
      touch.send("Input.dispatchTouchEvent", { type, touchPoints: [{ x: ring.x + x, y: ring.y + y }] });
    await finger("touchStart", 0, 0);
    await page.getByRole("button", { name: "Release the left hand" }).waitFor({ state: "attached" });
    for (const step of [1, 2, 3, 4]) await finger("touchMove", 6 * step, -12 * step);
    // The ring follows the finger over the screen.
    await page.waitForFunction(
      ({ limb, from }) => {
        const { stage, hands } = window.bunraku;
        const at = stage.puppet && stage.toScreen(stage.puppet.handle(limb, stage.rig.group.position.clone()));
        return hands.source(limb) === "pointer" && at !== null && at.y < from.y - 20;
      },
      { limb: LEFT_HAND, from: ring },
    );
    await touch.send("Input.dispatchTouchEvent", { type: "touchEnd", touchPoints: [] });
    await page.getByRole("button", { name: "Take the left hand" }).waitFor({ state: "attached" });
    await waitForRelease(page, LEFT_HAND);
  });
});
