/** Waits and measurements on the page's state, read from `window.bunraku`. */
import type { Page } from "playwright-core";
import type { SoundController } from "../../src/app/sound-controller";
import type { Puppeteer } from "../../src/client/puppeteer";
import type { Viewer } from "../../src/client/viewer";
import type { LimbController } from "../../src/input/limb-controller";
import type { Stage } from "../../src/stage/stage";

declare global {
  interface Window {
    /** Missing or incomplete until the page has started. */
    bunraku: { stage: Stage; viewer: Viewer; puppeteer: Puppeteer; hands: LimbController; listening: SoundController };
  }
}

export type Position = [number, number, number];

/** Indices of limbs. */
export const [LEFT_HAND, RIGHT_LEG] = [0, 3];

/** Wait until the first pose is drawn. The first frame compiles the shaders, which blocks a slow machine. */
export async function waitForFirstPose(page: Page): Promise<void> {
  await page.waitForFunction(
    () => window.bunraku?.stage?.puppet?.group.visible && window.bunraku.stage.hasDrawnPerformer,
  );
}

/**
 * Pause the session at position 0, for all viewers, and wait until the page shows that pose. There the hands of the
 * demo's motion hang down and can be moved upwards, which is not possible in every pose.
 */
export async function pauseAtStart(page: Page): Promise<void> {
  await page.evaluate(async () => {
    const session = new URLSearchParams(location.search).get("session");
    const response = await fetch(`/v1/sessions/${session}`, {
      method: "PATCH",
      headers: { "Content-Type": "application/json" },
      body: JSON.stringify({ playing: false, position: 0 }),
    });
    if (!response.ok) throw new Error(await response.text());
  });
  await page.waitForFunction(() => {
    const { viewer } = window.bunraku;
    // The newest timeline takes effect some time after it was received.
    const timeline = viewer.timelineHistory.at(viewer.presentationTime(performance.now()));
    return timeline !== null && !timeline.playing && timeline.position === 0 && viewer.blocks[0] >= 0;
  });
  await waitForDraw(page);
}

/** Tap a key. Key down and key up are sent together, so that a blocked page does not turn the tap into a long press. */
export async function tapKey(page: Page, key: string): Promise<void> {
  await Promise.all([page.keyboard.down(key), page.keyboard.up(key)]);
}

/**
 * Run `action` and wait for a toast with `text`. Toasts are brief: the page looks for it at every frame, from before the
 * action.
 */
export async function waitForToast<T>(page: Page, text: string, action: () => Promise<T>): Promise<T> {
  const shown = page.waitForFunction(
    (text) => [...document.querySelectorAll(".toast")].some(({ textContent }) => textContent.includes(text)),
    text,
  );
  return (await Promise.all([action(), shown]))[0];
}

/** Run `action` and click the button with `label` in the toast that follows, as soon as it is shown. */
export async function clickInToast(page: Page, label: string, action: () => Promise<unknown>): Promise<void> {
  const clicked = page.waitForFunction((label) => {
    const buttons = [...document.querySelectorAll<HTMLElement>(".toast-action")];
    const button = buttons.find(({ textContent }) => textContent.startsWith(label));
    button?.click();
    return button !== undefined;
  }, label);
  await Promise.all([action(), clicked]);
}

/**
 * Disable rendering on a page. Two pages that render in software starve each other, and a page that is blocked for half
 * a second loses its limbs.
 */
export async function stopDrawing(page: Page): Promise<void> {
  await page.evaluate(() => void (window.bunraku.stage.renderer.render = () => undefined));
}

/** Wait for the session's Welcome message. After it, the page can claim limbs. */
export async function waitForWelcome(page: Page): Promise<void> {
  await page.waitForFunction(() => (window.bunraku?.puppeteer?.id ?? null) !== null);
}

/** Wait until the page's puppeteer holds a limb. */
export async function waitForHold(page: Page, limb: number): Promise<void> {
  await page.waitForFunction((limb) => window.bunraku.puppeteer.holds(limb), limb);
}

/** Wait until no input of the page controls a limb. */
export async function waitForRelease(page: Page, limb: number): Promise<void> {
  await page.waitForFunction((limb) => window.bunraku.hands.source(limb) === null, limb);
}

/** Return the position of a joint in world coordinates, in metres. */
export function jointPosition(page: Page, joint: string): Promise<Position> {
  return page.evaluate((joint) => {
    const at = window.bunraku.stage.scene.getObjectByName(joint)?.matrixWorld.elements;
    if (!at) throw new Error(`Joint ${joint} is not in the scene`);
    return [at[12], at[13], at[14]] as Position;
  }, joint);
}

/** Return the screen position of a limb's ring, in CSS pixels. */
export function ringPosition(page: Page, limb: number): Promise<{ x: number; y: number }> {
  return page.evaluate((limb) => {
    const { stage } = window.bunraku;
    const puppet = stage.performers[limb >> 2];
    if (!puppet) throw new Error(`No performer on the stage has limb ${limb}`);
    return stage.toScreen(puppet.handle(limb & 3, stage.rig.group.position.clone()));
  }, limb);
}

/** Wait until `count` performers are visible on the stage. */
export async function waitForPerformers(page: Page, count: number): Promise<void> {
  await page.waitForFunction(
    (count) => window.bunraku.stage.performers.filter(({ group }) => group.visible).length === count,
    count,
  );
}

/** Wait until the page has drawn its present state. */
export function waitForDraw(page: Page): Promise<unknown> {
  return page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
}

/**
 * Repeat a measurement until it stays within `tolerance` of its first value six times in a row, some frames apart.
 * Comparing with the first value detects slow motion too. Returns the last value.
 */
export async function waitUntilSettled<T extends object>(
  page: Page,
  measure: () => Promise<T>,
  tolerance: number,
): Promise<T> {
  let first = await measure();
  for (let same = 0; ; ) {
    await waitForDraw(page);
    const now = await measure();
    const before: number[] = Object.values(first);
    if (Math.hypot(...Object.values(now).map((number: number, at) => number - before[at])) >= tolerance)
      [first, same] = [now, 0];
    else if (++same === 5) return now;
  }
}
