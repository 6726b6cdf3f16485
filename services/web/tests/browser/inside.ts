/** What a page shows and does, seen from inside: by the parts that it has in `window.bunraku`. */
import type { Page } from "playwright-core";
import type { Puppeteer } from "../../src/client/puppeteer";
import type { Viewer } from "../../src/client/viewer";
import type { Hands } from "../../src/input/hands";
import type { Listening } from "../../src/listening";
import type { Stage } from "../../src/stage/stage";

declare global {
  interface Window {
    /** Not there, or without some of its parts, until the page has begun. */
    bunraku: { stage: Stage; viewer: Viewer; puppeteer: Puppeteer; hands: Hands; listening: Listening };
  }
}

export type Place = [number, number, number];

/** Indices of limbs. */
export const [LEFT_HAND, RIGHT_LEG] = [0, 3];

/** Waits for the first pose on the stage. */
export async function danced(page: Page): Promise<void> {
  await page.waitForFunction(() => window.bunraku?.stage?.puppet?.group.visible);
}

/** Waits for the session's welcome: from then on limbs can be taken. */
export async function welcomed(page: Page): Promise<void> {
  await page.waitForFunction(() => (window.bunraku?.puppeteer?.id ?? null) !== null);
}

/** Waits until the page's puppeteer holds a limb. */
export async function holds(page: Page, limb: number): Promise<void> {
  await page.waitForFunction((limb) => window.bunraku.puppeteer.holds(limb), limb);
}

/** Waits until none of the page's inputs has a limb any more. */
export async function letGo(page: Page, limb: number): Promise<void> {
  await page.waitForFunction((limb) => window.bunraku.hands.source(limb) === null, limb);
}

/** World place of a joint, metres. */
export function placeOf(page: Page, joint: string): Promise<Place> {
  return page.evaluate((joint) => {
    const at = window.bunraku.stage.scene.getObjectByName(joint)?.matrixWorld.elements;
    if (!at) throw new Error(`no ${joint} on the stage`);
    return [at[12], at[13], at[14]] as Place;
  }, joint);
}

/** Where a limb's ring is on the screen, pixels. */
export function ringOf(page: Page, limb: number): Promise<{ x: number; y: number }> {
  return page.evaluate((limb) => {
    const { stage } = window.bunraku;
    if (!stage.puppet) throw new Error("no puppet on the stage");
    return stage.toScreen(stage.puppet.handle(limb, stage.rig.group.position.clone()));
  }, limb);
}

/** Waits until the page has drawn what it knows by now. */
export function drawn(page: Page): Promise<unknown> {
  return page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
}

/** What `look` finds once five frames running have shown the same, to `within` of its unit. */
export async function settled<T extends object>(page: Page, look: () => Promise<T>, within: number): Promise<T> {
  let last = await look();
  for (let same = 0; same < 5; ) {
    await drawn(page);
    const now = await look();
    const before: number[] = Object.values(last);
    same = Math.hypot(...Object.values(now).map((number: number, at) => number - before[at])) < within ? same + 1 : 0;
    last = now;
  }
  return last;
}
