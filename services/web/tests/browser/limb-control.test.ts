/** What a puppeteer has in the hand, in a real browser: keys bound anew and remembered, arrows pressed and held, a held limb asked for and given, a performance kept. */
import type { Page, WebSocketRoute } from "playwright-core";
import { expect, test } from "vitest";
import { describeInBrowser, type OpenOptions } from "./browser-suite";
import {
  jointPosition,
  LEFT_HAND,
  pauseAtStart,
  RIGHT_LEG,
  stopDrawing,
  tapKey,
  waitForDraw,
  waitForFirstPose,
  waitForHold,
  waitForRelease,
  waitForToast,
  waitForWelcome,
  waitUntilSettled,
} from "./page-probe";

/** Paused on entering, as less motion is asked for. */
const CALM: OpenOptions = { viewport: { width: 760, height: 560 }, reducedMotion: "reduce" };

describeInBrowser("a puppeteer's hands", { demo: true }, (own) => {
  /** A page of somebody, with storage of its own; `lines` are the lines it opens to see the stage. */
  async function open(name: string, lines: WebSocketRoute[] = []): Promise<Page> {
    const before = (page: Page) =>
      page.routeWebSocket(/\/stream/, (line) => {
        line.connectToServer();
        lines.push(line);
      });
    const page = await own.open(`?name=${name}`, { ...CALM, before });
    await ready(page);
    return page;
  }

  test("a key bound anew moves its limb, also after the page is loaded again; what is kept and broken is the default", async () => {
    const page = await open("Aiko");
    await page.keyboard.press("KeyU");
    expect(await source(page)).toBe(null);
    await page.keyboard.press("Shift+Slash");
    await page.getByText("The 14 inputs, one by one").click();
    await page.getByRole("button", { name: "Bind a key or button: left hand up" }).click();
    await page.keyboard.press("KeyU");
    await page.getByRole("button", { name: "U: left hand up. Remove" }).waitFor();
    // A second meaning is shown at both ends.
    await page.getByRole("button", { name: "Bind a key or button: connection", exact: true }).click();
    await page.keyboard.press("KeyU");
    expect(await page.locator(".clash:not([hidden])").allInnerTexts()).toEqual([
      "U also: left hand up",
      "U also: connection",
    ]);
    await page.getByRole("button", { name: "U: connection. Remove" }).click();
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
    await waitForHold(page, LEFT_HAND);
    await page.keyboard.up("KeyU");
    // Let go by itself after a rest: a push is no hold.
    await waitForRelease(page, LEFT_HAND);
    expect(await deadZone(page)).toBe("0.3");

    for (const broken of ["{", JSON.stringify({ version: 1, mapping: { bindings: { KeyU: ["fly"] } } })]) {
      await page.evaluate((content) => localStorage.setItem("bunraku.mapping", content), broken);
      await page.reload();
      await ready(page);
      await page.keyboard.press("KeyU");
      expect(await source(page)).toBe(null);
      expect(await deadZone(page)).toBe("0.16");
    }
  });

  test("the arrows of a held limb are pressed and held, by keyboard and by pointer, and go on when the line is lost", async () => {
    const lines: WebSocketRoute[] = [];
    const page = await open("Aiko", lines);
    await pauseAtStart(page);
    await page.keyboard.press("KeyS");
    await page.getByRole("button", { name: "Take left hand" }).click();
    await waitForHold(page, LEFT_HAND);
    const pad = page.getByRole("group", { name: "Move the left hand" });
    expect(
      await pad.getByRole("button").evaluateAll((all) => all.map((one) => one.getAttribute("aria-label"))),
    ).toEqual(["Nearer", "Up", "Further", "Left", "Down", "Right"]);
    const wrist = await height(page, "l_wrist");
    await pad.getByRole("button", { name: "Up" }).focus();
    await page.keyboard.down("Space");
    // so far up that there is as much room downwards as is looked for next
    await page.waitForFunction(moved, { from: wrist, least: 0.15 });
    await page.keyboard.up("Space");
    await still(page);

    const between = await height(page, "l_wrist");
    const back = pad.getByRole("button", { name: "Down" });
    await back.hover();
    await page.mouse.down();
    await page.waitForFunction(moved, { from: between, least: 0.05 });
    const before = lines.length;
    await waitForToast(page, "Connection lost, reconnecting", async () =>
      lines.at(-1)?.close({ code: 1012, reason: "cut by the test" }),
    );
    await expect.poll(() => lines.length).toBeGreaterThan(before);
    await expect.poll(() => page.getByRole("button", { name: "Release left hand" }).isEnabled()).toBe(true);
    expect(await back.getAttribute("data-on")).toBe("");
    await page.mouse.up();
    await still(page);
    expect(await page.getByRole("button", { name: "Play", exact: true }).isVisible()).toBe(true);
    await page.getByRole("button", { name: "Release left hand" }).click();
    await pad.waitFor({ state: "hidden" });
  });

  test("a gamepad's stick takes its hand, and a button that was pressed for it moves a leg", async () => {
    const before = (page: Page) =>
      page.addInitScript(() => {
        const buttons = Array.from({ length: 17 }, () => ({ pressed: false, touched: false, value: 0 }));
        Object.assign(window, {
          pad: { connected: true, mapping: "standard", id: "A pad (made for this)", axes: [0, 0, 0, 0], buttons },
        });
        navigator.getGamepads = () => [(window as unknown as { pad: Gamepad }).pad];
      });
    const page = await own.open("?name=Kiku", { ...CALM, before });
    await ready(page);
    await pauseAtStart(page);
    const wrist = await height(page, "l_wrist");
    await pad(page, { axis: [1, -0.9] });
    await waitForHold(page, LEFT_HAND);
    await page.waitForFunction(moved, { from: wrist, least: 0.05 });
    await pad(page, { axis: [1, 0] });
    await waitForRelease(page, LEFT_HAND);

    await page.keyboard.press("Shift+Slash");
    await page.getByText("A pad is connected").waitFor();
    await page.getByText("The 14 inputs, one by one").click();
    await page.getByRole("button", { name: "Bind a key or button: right leg up" }).click();
    await pad(page, {}); // What is down as the listening begins does not count.
    await pad(page, { button: [1, 1] });
    await pad(page, { button: [1, 0] });
    await page.getByRole("button", { name: "B: right leg up. Remove" }).waitFor();
    await page.keyboard.press("Escape");
    await pad(page, { button: [1, 1] });
    await waitForHold(page, RIGHT_LEG);
  });

  test("a held limb is asked for, shown to its holder, and given; and what was done is kept", async () => {
    const [aiko, mateo] = [await open("Aiko"), await open("Mateo")];
    // who is asked for a limb gives it up by silence too
    for (const page of [aiko, mateo]) await stopDrawing(page);
    await tapKey(aiko, "Digit2");
    await mateo.getByRole("button", { name: "Left hand, held by Aiko" }).waitFor();
    await waitForToast(mateo, "Aiko holds the left hand", () => tapKey(mateo, "Digit2"));
    expect(await source(mateo)).toBe(null);
    await mateo.keyboard.press("KeyR");
    const asked = aiko.getByText("Mateo asks for the left hand");
    await asked.waitFor();
    await mateo.keyboard.press("KeyS");
    // Withdrawn and asked again, from the card.
    await mateo.getByRole("button", { name: "Withdraw the request for left hand" }).click();
    await asked.waitFor({ state: "detached" });
    await mateo.getByRole("button", { name: "Ask for left hand" }).click();
    await asked.waitFor();
    expect(await source(aiko)).toBe("velocity");
    await aiko.keyboard.press("KeyG");
    await mateo.getByRole("button", { name: "Release left hand" }).waitFor();
    await waitForHold(mateo, LEFT_HAND);
    await aiko.getByRole("button", { name: "Left hand, held by Mateo" }).waitFor();
    expect([await source(aiko), await source(mateo)]).toEqual([null, "velocity"]);
    await asked.waitFor({ state: "detached" });
    // What they did is kept by one key, and danced from the toast.
    await aiko.keyboard.press("KeyK");
    await aiko.getByRole("button", { name: "Dance it" }).click();
    await aiko.locator(".brand-piece", { hasText: "as Aiko pulled it" }).waitFor();
    await mateo.locator(".brand-piece", { hasText: "as Aiko pulled it" }).waitFor();
  });
});

/** Waits for the first pose on the stage, and the session's welcome. */
async function ready(page: Page): Promise<void> {
  await waitForFirstPose(page);
  await waitForWelcome(page);
  await page.getByRole("button", { name: "Play", exact: true }).waitFor();
}

/** What holds the left hand on a page. */
function source(page: Page): Promise<string | null> {
  return page.evaluate((limb) => window.bunraku.hands.source(limb), LEFT_HAND);
}

/** Puts an axis or a button of the page's gamepad, and waits until it was looked at. */
async function pad(page: Page, to: { axis?: [number, number]; button?: [number, number] }): Promise<void> {
  await page.evaluate(({ axis, button }) => {
    const { pad } = window as unknown as { pad: { axes: number[]; buttons: { pressed: boolean; value: number }[] } };
    if (axis) pad.axes[axis[0]] = axis[1];
    if (button) Object.assign(pad.buttons[button[0]], { value: button[1], pressed: button[1] > 0.5 });
  }, to);
  await waitForDraw(page);
}

/** What the slider of the dead zone says; it is there once the page of keys is open. */
async function deadZone(page: Page): Promise<string> {
  await page.keyboard.press("Shift+Slash");
  const value = await page.getByRole("slider", { name: "Dead zone" }).inputValue();
  await page.keyboard.press("Escape");
  return value;
}

/** Height of a joint, metres. */
async function height(page: Page, joint: string): Promise<number> {
  return (await jointPosition(page, joint))[1];
}

/** In the page: the left wrist is so far from a height, metres. */
function moved({ from, least }: { from: number; least: number }): boolean {
  const at = window.bunraku.stage.scene.getObjectByName("l_wrist")?.matrixWorld.elements[13];
  return at !== undefined && Math.abs(at - from) >= least;
}

/** Waits until the left wrist stands still. */
async function still(page: Page): Promise<void> {
  await waitUntilSettled(page, async () => [await height(page, "l_wrist")], 1e-3);
}
