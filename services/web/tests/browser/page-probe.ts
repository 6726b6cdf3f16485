/** Waits and measurements on the state of a page and its engine. */
import type { Page } from "playwright-core";
import { engineWorker, evaluateInEngine, waitForFrames, waitInEngine } from "./engine-probe";

export type Position = [number, number, number];

/** Indices of limbs. */
export const [LEFT_HAND, RIGHT_LEG] = [0, 3];

/**
 * Wait until the first pose is drawn and the page around the stage, which loads later, handles keys. The first frame
 * compiles the shaders, which blocks a slow machine.
 */
export async function waitForFirstPose(page: Page): Promise<void> {
  await waitInEngine(page, () => {
    const stage = globalThis.bunraku?.stage;
    return Boolean(stage?.puppet?.group.visible && stage.hasDrawnPerformer);
  });
  await page.waitForFunction(() => window.bunraku?.listening !== undefined);
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
  await waitInEngine(page, () => {
    const { viewer } = globalThis.bunraku;
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
 * Run `action` and wait for a toast with `text`. Toasts are brief: the page looks for it at every frame, from before
 * the action.
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
  await evaluateInEngine(page, () => void (globalThis.bunraku.stage.renderer.render = () => undefined));
}

/** Wait for the session's Welcome message. After it, the page can claim limbs. */
export async function waitForWelcome(page: Page): Promise<void> {
  await waitInEngine(page, () => (globalThis.bunraku?.puppeteer?.id ?? null) !== null);
}

/** Wait until the page's puppeteer holds a limb. */
export async function waitForHold(page: Page, limb: number): Promise<void> {
  await waitInEngine(page, (limb) => globalThis.bunraku.puppeteer.holds(limb), limb);
}

/** Wait until no input of the page controls a limb. */
export async function waitForRelease(page: Page, limb: number): Promise<void> {
  await waitInEngine(page, (limb) => globalThis.bunraku.hands.source(limb) === null, limb);
}

/** Return the position of a joint in world coordinates, in metres. */
export function jointPosition(page: Page, joint: string): Promise<Position> {
  return evaluateInEngine(
    page,
    (joint) => {
      const at = globalThis.bunraku.stage.scene.getObjectByName(joint)?.matrixWorld.elements;
      if (!at) throw new Error(`Joint ${joint} is not in the scene`);
      return [at[12], at[13], at[14]] as Position;
    },
    joint,
  );
}

/** Return the screen position of a limb's ring, in CSS pixels. */
export function ringPosition(page: Page, limb: number): Promise<{ x: number; y: number }> {
  return evaluateInEngine(
    page,
    (limb) => {
      const { stage } = globalThis.bunraku;
      const puppet = stage.performers[limb >> 2];
      if (!puppet) throw new Error(`No performer on the stage has limb ${limb}`);
      return stage.toScreen(puppet.handle(limb & 3, stage.rig.group.position.clone()));
    },
    limb,
  );
}

/** Wait until `count` performers are visible on the stage. */
export async function waitForPerformers(page: Page, count: number): Promise<void> {
  await waitInEngine(
    page,
    (count) => globalThis.bunraku.stage.performers.filter(({ group }) => group.visible).length === count,
    count,
  );
}

/** Return the shader programs of the stage, and whether each is valid. */
export function readPrograms(page: Page): Promise<{ key: string; isValid: boolean }[]> {
  return evaluateInEngine(page, () => {
    const { renderer } = globalThis.bunraku.stage;
    const gl = renderer.getContext();
    return (renderer.info.programs ?? []).map(({ cacheKey, program }) => ({
      key: cacheKey,
      isValid: gl.getProgramParameter(program as WebGLProgram, gl.LINK_STATUS) as boolean,
    }));
  });
}

/** Wait until the page and its engine have drawn their present state, and the page that of its engine. */
export async function waitForDraw(page: Page): Promise<void> {
  await waitForFrames(page);
  const worker = engineWorker(page);
  if (!worker) return;
  await waitForFrames(worker);
  await waitForFrames(page);
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
