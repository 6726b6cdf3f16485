/** What a page shows and does, seen from inside: by the parts that it has in `window.bunraku`. */
import type { Page } from "playwright-core";
import type { SoundController } from "../../src/app/sound-controller";
import type { Puppeteer } from "../../src/client/puppeteer";
import type { Viewer } from "../../src/client/viewer";
import type { LimbController } from "../../src/input/limb-controller";
import type { Stage } from "../../src/stage/stage";

declare global {
  interface Window {
    /** Not there, or without some of its parts, until the page has begun. */
    bunraku: { stage: Stage; viewer: Viewer; puppeteer: Puppeteer; hands: LimbController; listening: SoundController };
  }
}

export type Position = [number, number, number];

/** Indices of limbs. */
export const [LEFT_HAND, RIGHT_LEG] = [0, 3];

/** Waits for the first pose on the stage, and until it was drawn: the first picture makes the shaders, over which a slow machine stands still. */
export async function waitForFirstPose(page: Page): Promise<void> {
  await page.waitForFunction(() => window.bunraku?.stage?.puppet?.group.visible);
  // one is begun only when the one before is done
  const begun = await page.evaluate(() => window.bunraku.stage.renderer.info.render.frame);
  await page.waitForFunction((begun) => window.bunraku.stage.renderer.info.render.frame > begun + 1, begun);
}

/**
 * Puts the session on the stage at the beginning of its dance and pauses it, for everyone, and waits until the page shows that. There the hands of our own
 * dance hang down, and have room upwards, as they have not everywhere.
 */
export async function pauseAtStart(page: Page): Promise<void> {
  await page.evaluate(async () => {
    const session = new URLSearchParams(location.search).get("session");
    const edit = {
      method: "PATCH",
      headers: { "Content-Type": "application/json" },
      body: JSON.stringify({ playing: false, position: 0 }),
    };
    const answer = await fetch(`/v1/sessions/${session}`, edit);
    if (!answer.ok) throw new Error(await answer.text());
  });
  await page.waitForFunction(() => {
    const { viewer } = window.bunraku;
    // not the newest, which holds from a while after it was told of
    const timeline = viewer.timelineHistory.at(viewer.presentationTime(performance.now()));
    return timeline !== null && !timeline.playing && timeline.position === 0 && viewer.blocks[0] >= 0;
  });
  await waitForDraw(page);
}

/** Presses a key and lets it up at once: a key held for long means something else, and a page that stands still between the two makes a tap long. */
export async function tapKey(page: Page, key: string): Promise<void> {
  await Promise.all([page.keyboard.down(key), page.keyboard.up(key)]);
}

/** What `act` gives, once the page has said a `text` over it, which it does in passing: so it is looked for from before. */
export async function waitForToast<T>(page: Page, text: string, act: () => Promise<T>): Promise<T> {
  const [done] = await Promise.all([act(), page.locator(".toast", { hasText: text }).waitFor()]);
  return done;
}

/** Draws the stage no more. Two pages that draw in software starve each other, and what a page holds that stands still for half a second is lost. */
export async function stopDrawing(page: Page): Promise<void> {
  await page.evaluate(() => void (window.bunraku.stage.renderer.render = () => undefined));
}

/** Waits for the session's welcome: from then on limbs can be taken. */
export async function waitForWelcome(page: Page): Promise<void> {
  await page.waitForFunction(() => (window.bunraku?.puppeteer?.id ?? null) !== null);
}

/** Waits until the page's puppeteer holds a limb. */
export async function waitForHold(page: Page, limb: number): Promise<void> {
  await page.waitForFunction((limb) => window.bunraku.puppeteer.holds(limb), limb);
}

/** Waits until none of the page's inputs has a limb any more. */
export async function waitForRelease(page: Page, limb: number): Promise<void> {
  await page.waitForFunction((limb) => window.bunraku.hands.source(limb) === null, limb);
}

/** World place of a joint, metres. */
export function jointPosition(page: Page, joint: string): Promise<Position> {
  return page.evaluate((joint) => {
    const at = window.bunraku.stage.scene.getObjectByName(joint)?.matrixWorld.elements;
    if (!at) throw new Error(`no ${joint} on the stage`);
    return [at[12], at[13], at[14]] as Position;
  }, joint);
}

/** Where a limb's ring is on the screen, pixels, by the limb's number. */
export function ringPosition(page: Page, limb: number): Promise<{ x: number; y: number }> {
  return page.evaluate((limb) => {
    const { stage } = window.bunraku;
    const puppet = stage.performers[limb >> 2];
    if (!puppet) throw new Error("nobody on the stage has this limb");
    return stage.toScreen(puppet.handle(limb & 3, stage.rig.group.position.clone()));
  }, limb);
}

/** Waits until so many are on the stage, and the page knows whose strings there are. */
export async function waitForPerformers(page: Page, count: number): Promise<void> {
  await page.waitForFunction(
    (count) => window.bunraku.stage.performers.filter(({ group }) => group.visible).length === count,
    count,
  );
}

/** Waits until the page has drawn what it knows by now. */
export function waitForDraw(page: Page): Promise<unknown> {
  return page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
}

/** What `look` finds once it has found the same six times running, some frames apart, to `within` of its unit: what moves slowly is told from what stands. */
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
