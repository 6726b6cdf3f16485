/** What a puppeteer has in the hand, in a real browser: keys bound anew and remembered, arrows pressed and held, a held limb asked for and given, a performance kept. */
import type { Browser, Page } from "playwright-core";
import { afterAll, beforeAll, describe, expect, test } from "vitest";
import type { Puppeteer } from "../../src/client/puppeteer";
import type { Hands } from "../../src/input/hands";
import type { Stage } from "../../src/stage/stage";
import { launch } from "./chromium";
import { chromium, startServer, type RunningServer } from "./server";

type Inside = { bunraku: { stage: Stage; hands: Hands; puppeteer: Puppeteer } };

const [LEFT_HAND, RIGHT_LEG] = [0, 3];
const PATIENCE = 90_000;

const path = chromium();
if (!path && process.env["CI"]) throw new Error("the browser tests must run in CI: install Chromium");
if (!path) console.warn("browser test of hands skipped: Chromium is not installed");

describe.skipIf(!path)("a puppeteer's hands", { timeout: 2 * PATIENCE }, () => {
  let server: RunningServer;
  let browser: Browser;

  beforeAll(async () => {
    [server, browser] = await Promise.all([startServer({ demo: true }), launch(path ?? "")]);
  }, PATIENCE);
  afterAll(async () => {
    await browser?.close();
    await server?.stop();
  }, PATIENCE);

  /** A page of somebody, with storage of its own. */
  async function open(name: string): Promise<Page> {
    // Small, as the picture is drawn in software; paused on entering, as less motion is asked for.
    const page = await browser.newPage({ viewport: { width: 760, height: 560 }, reducedMotion: "reduce" });
    page.setDefaultTimeout(PATIENCE);
    page.on("pageerror", (error) => {
      throw error;
    });
    await page.goto(`${server.url}?name=${name}`);
    await ready(page);
    return page;
  }

  test("a key bound anew moves its limb, also after the page is loaded again; what is kept and broken is the default", async () => {
    const page = await open("Aiko");
    await page.keyboard.press("KeyU");
    expect(await source(page)).toBe(null);
    await page.keyboard.press("Shift+Slash");
    await page.getByText("The 14 inputs, each by itself").click();
    await page.getByRole("button", { name: "Bind a key or button: left hand up" }).click();
    await page.keyboard.press("KeyU");
    await page.getByRole("button", { name: "U: left hand up. Take away" }).waitFor();
    // A second meaning is shown at both ends.
    await page.getByRole("button", { name: "Bind a key or button: line", exact: true }).click();
    await page.keyboard.press("KeyU");
    expect(await page.locator(".clash:not([hidden])").allInnerTexts()).toEqual(["U also: left hand up", "U also: line"]);
    await page.getByRole("button", { name: "U: line. Take away" }).click();
    expect(await page.locator(".clash:not([hidden])").count()).toBe(0);
    // Escape ends waiting for a key, and only then the page of keys.
    await page.getByRole("button", { name: "Bind a key or button: keep" }).click();
    await page.keyboard.press("Escape");
    expect(await page.locator("dialog[open]").count()).toBe(1);
    await page.getByRole("slider", { name: "Dead zone" }).fill("0.3");
    await page.keyboard.press("Escape");
    await page.locator("dialog").waitFor({ state: "hidden" });

    await page.reload();
    await ready(page);
    await page.keyboard.down("KeyU");
    await page.waitForFunction((limb) => (window as unknown as Inside).bunraku.puppeteer.holds(limb), LEFT_HAND);
    await page.keyboard.up("KeyU");
    // Let go by itself after a rest: a push is no hold.
    await page.waitForFunction((limb) => (window as unknown as Inside).bunraku.hands.source(limb) === null, LEFT_HAND);
    expect(await deadZone(page)).toBe("0.3");

    for (const broken of ["{", JSON.stringify({ version: 1, mapping: { bindings: { KeyU: ["fly"] } } })]) {
      await page.evaluate((content) => localStorage.setItem("bunraku.mapping", content), broken);
      await page.reload();
      await ready(page);
      await page.keyboard.press("KeyU");
      expect(await source(page)).toBe(null);
      expect(await deadZone(page)).toBe("0.16");
    }
    await page.close();
  });

  test("the arrows of a held limb are pressed and held, by keyboard and by pointer", async () => {
    const page = await open("Aiko");
    await page.keyboard.press("KeyS");
    await page.getByRole("button", { name: "Take left hand" }).click();
    await page.waitForFunction((limb) => (window as unknown as Inside).bunraku.puppeteer.holds(limb), LEFT_HAND);
    const pad = page.getByRole("group", { name: "Move the left hand" });
    expect(await pad.getByRole("button").evaluateAll((all) => all.map((one) => one.getAttribute("aria-label")))).toEqual(["Nearer", "Up", "Further", "Left", "Down", "Right"]);
    // Wherever the dance stands still, there is room towards the shoulder's height.
    const [wrist, shoulder] = [await height(page, "l_wrist"), await height(page, "l_shoulder")];
    const way = wrist < shoulder ? "Up" : "Down";
    await pad.getByRole("button", { name: way }).focus();
    await page.keyboard.down("Space");
    await page.waitForFunction(moved, { from: wrist, least: 0.05 });
    await page.keyboard.up("Space");
    await still(page);

    const between = await height(page, "l_wrist");
    const back = pad.getByRole("button", { name: way === "Up" ? "Down" : "Up" });
    await back.hover();
    await page.mouse.down();
    await page.waitForFunction(moved, { from: between, least: 0.05 });
    await page.mouse.up();
    await still(page);
    expect(await page.getByRole("button", { name: "Play", exact: true }).isVisible()).toBe(true);
    await page.getByRole("button", { name: "Release left hand" }).click();
    await pad.waitFor({ state: "hidden" });
    await page.close();
  });

  test("a gamepad's stick takes its hand, and a button that was pressed for it moves a leg", async () => {
    const page = await browser.newPage({ viewport: { width: 760, height: 560 }, reducedMotion: "reduce" });
    page.setDefaultTimeout(PATIENCE);
    await page.addInitScript(() => {
      const buttons = Array.from({ length: 17 }, () => ({ pressed: false, touched: false, value: 0 }));
      Object.assign(window, { pad: { connected: true, mapping: "standard", id: "A pad (made for this)", axes: [0, 0, 0, 0], buttons } });
      navigator.getGamepads = () => [(window as unknown as { pad: Gamepad }).pad];
    });
    await page.goto(`${server.url}?name=Kiku`);
    await ready(page);
    await pad(page, { axis: [1, -0.9] });
    await page.waitForFunction((limb) => (window as unknown as Inside).bunraku.puppeteer.holds(limb), LEFT_HAND);
    await pad(page, { axis: [1, 0] });
    await page.waitForFunction((limb) => (window as unknown as Inside).bunraku.hands.source(limb) === null, LEFT_HAND);

    await page.keyboard.press("Shift+Slash");
    await page.getByText("A pad is connected").waitFor();
    await page.getByText("The 14 inputs, each by itself").click();
    await page.getByRole("button", { name: "Bind a key or button: right leg up" }).click();
    await pad(page, {}); // What is down as the listening begins does not count.
    await pad(page, { button: [1, 1] });
    await pad(page, { button: [1, 0] });
    await page.getByRole("button", { name: "B: right leg up. Take away" }).waitFor();
    await page.keyboard.press("Escape");
    await pad(page, { button: [1, 1] });
    await page.waitForFunction((limb) => (window as unknown as Inside).bunraku.puppeteer.holds(limb), RIGHT_LEG);
    await page.close();
  });

  test("a held limb is asked for, shown to its holder, and given; and what was done is kept", async () => {
    const [aiko, mateo] = [await open("Aiko"), await open("Mateo")];
    await aiko.keyboard.press("Digit2");
    await mateo.getByRole("button", { name: "Left hand, held by Aiko" }).waitFor();
    await mateo.keyboard.press("Digit2");
    await mateo.getByText("Aiko holds the left hand").waitFor();
    expect(await source(mateo)).toBe(null);
    await mateo.keyboard.press("KeyR");
    const asked = aiko.getByText("Mateo asks for the left hand");
    await asked.waitFor();
    await mateo.keyboard.press("KeyS");
    // Withdrawn and asked again, from the card.
    await mateo.getByRole("button", { name: "Ask no longer for left hand" }).click();
    await asked.waitFor({ state: "detached" });
    await mateo.getByRole("button", { name: "Ask for left hand" }).click();
    await asked.waitFor();
    expect(await source(aiko)).toBe("velocity");
    await aiko.keyboard.press("KeyG");
    await mateo.getByRole("button", { name: "Release left hand" }).waitFor();
    await mateo.waitForFunction((limb) => (window as unknown as Inside).bunraku.puppeteer.holds(limb), LEFT_HAND);
    await aiko.getByRole("button", { name: "Left hand, held by Mateo" }).waitFor();
    expect([await source(aiko), await source(mateo)]).toEqual([null, "velocity"]);
    await asked.waitFor({ state: "detached" });
    // What they did is kept by one key, and danced from the toast.
    await aiko.keyboard.press("KeyK");
    await aiko.getByRole("button", { name: "Dance it" }).click();
    await aiko.locator(".brand-piece", { hasText: "as Aiko pulled it" }).waitFor();
    await mateo.locator(".brand-piece", { hasText: "as Aiko pulled it" }).waitFor();
    await aiko.close();
    await mateo.close();
  });
});

/** Waits for the first pose on the stage, and the session's welcome. */
async function ready(page: Page): Promise<void> {
  await page.waitForFunction(() => {
    const { stage, puppeteer } = (window as unknown as Partial<Inside>).bunraku ?? {};
    return Boolean(stage?.puppet?.group.visible && puppeteer?.id);
  });
  await page.getByRole("button", { name: "Play", exact: true }).waitFor();
}

/** What holds the left hand on a page. */
function source(page: Page): Promise<string | null> {
  return page.evaluate((limb) => (window as unknown as Inside).bunraku.hands.source(limb), LEFT_HAND);
}

/** Puts an axis or a button of the page's gamepad, and waits until it was looked at. */
function pad(page: Page, to: { axis?: [number, number]; button?: [number, number] }): Promise<unknown> {
  return page.evaluate(({ axis, button }) => {
    const { pad } = window as unknown as { pad: { axes: number[]; buttons: { pressed: boolean; value: number }[] } };
    if (axis) pad.axes[axis[0]] = axis[1];
    if (button) Object.assign(pad.buttons[button[0]], { value: button[1], pressed: button[1] > 0.5 });
    return new Promise((drawn) => requestAnimationFrame(() => requestAnimationFrame(drawn)));
  }, to);
}

/** What the slider of the dead zone says; it is there once the page of keys is open. */
async function deadZone(page: Page): Promise<string> {
  await page.keyboard.press("Shift+Slash");
  const value = await page.getByRole("slider", { name: "Dead zone" }).inputValue();
  await page.keyboard.press("Escape");
  return value;
}

function height(page: Page, joint: string): Promise<number> {
  return page.evaluate((name) => (window as unknown as Inside).bunraku.stage.scene.getObjectByName(name)?.matrixWorld.elements[13] ?? NaN, joint);
}

/** In the page: the left wrist is so far from a height, metres. */
function moved({ from, least }: { from: number; least: number }): boolean {
  const at = (window as unknown as Inside).bunraku.stage.scene.getObjectByName("l_wrist")?.matrixWorld.elements[13];
  return at !== undefined && Math.abs(at - from) >= least;
}

/** Waits until the left wrist stands still for five frames. */
async function still(page: Page): Promise<void> {
  let last = await height(page, "l_wrist");
  for (let same = 0; same < 5; ) {
    await page.evaluate(() => new Promise((drawn) => requestAnimationFrame(() => requestAnimationFrame(drawn))));
    const now = await height(page, "l_wrist");
    same = Math.abs(now - last) < 1e-3 ? same + 1 : 0;
    last = now;
  }
}
