/** Control of limbs: key bindings, arrow buttons, gamepads, hand-over between puppeteers, and recording. */
import type { Page } from "playwright-core";
import { expect, test } from "vitest";
import { describeInBrowser, type OpenOptions } from "./browser-suite";
import { evaluateInEngine, waitInEngine } from "./engine-probe";
import {
  clickInToast,
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

/** With reduced motion, the session is paused when the page opens. */
const REDUCED_MOTION: OpenOptions = { viewport: { width: 760, height: 560 }, reducedMotion: "reduce" };

describeInBrowser("limb control", { server: "open" }, (fixture) => {
  /** Open a page of a puppeteer with this name. */
  async function open(name: string, server = fixture.url): Promise<Page> {
    const page = await fixture.open(`${server}/?session=${fixture.session}&name=${name}`, REDUCED_MOTION);
    await waitUntilReady(page);
    return page;
  }

  test("keys pressed before the page knows of their claim move the limb", async () => {
    const page = await open("Aiko");
    await pauseAtStart(page);
    const before = await jointPosition(page, "l_wrist");
    await page.evaluate(() => {
      const press = (type: string, code: string) =>
        document.body.dispatchEvent(new KeyboardEvent(type, { code, bubbles: true }));
      press("keydown", "Digit2");
      press("keyup", "Digit2");
      press("keydown", "ArrowUp");
    });
    await waitInEngine(
      page,
      (height) =>
        (globalThis.bunraku.stage.scene.getObjectByName("l_wrist")?.matrixWorld.elements[13] ?? 0) > height + 0.05,
      before[1],
    );
  });

  test("a changed key binding is stored; a broken one falls back to defaults", async () => {
    const page = await open("Aiko");
    await page.keyboard.press("KeyU");
    expect(await controlSource(page)).toBe(null);
    await page.keyboard.press("Shift+Slash");
    await page.getByText("The 14 inputs, one by one").click();
    await page.getByRole("button", { name: "Bind a key or button: left hand up" }).click();
    await page.keyboard.press("KeyU");
    await page.getByRole("button", { name: "U: left hand up. Remove" }).waitFor();
    // A key with two commands shows a conflict at both.
    await page.getByRole("button", { name: "Bind a key or button: connection", exact: true }).click();
    await page.keyboard.press("KeyU");
    expect(await page.locator(".clash:not([hidden])").allInnerTexts()).toEqual([
      "U also: left hand up",
      "U also: connection",
    ]);
    await page.getByRole("button", { name: "U: connection. Remove" }).click();
    expect(await page.locator(".clash:not([hidden])").count()).toBe(0);
    // The first Escape cancels the binding, the second closes the dialog.
    await page.getByRole("button", { name: "Bind a key or button: keep" }).click();
    await page.keyboard.press("Escape");
    expect(await page.locator("dialog[open]").count()).toBe(1);
    await page.getByRole("slider", { name: "Dead zone" }).fill("0.3");
    await page.keyboard.press("Escape");
    await page.locator("dialog").waitFor({ state: "hidden" });

    await page.reload();
    await waitUntilReady(page);
    await page.keyboard.down("KeyU");
    await waitForHold(page, LEFT_HAND);
    await page.keyboard.up("KeyU");
    // A limb moved by key is released after a pause.
    await waitForRelease(page, LEFT_HAND);
    expect(await deadZone(page)).toBe("0.3");

    for (const broken of ["{", JSON.stringify({ version: 1, mapping: { bindings: { KeyU: ["fly"] } } })]) {
      await page.evaluate((content) => localStorage.setItem("bunraku.mapping", content), broken);
      await page.reload();
      await waitUntilReady(page);
      await page.keyboard.press("KeyU");
      expect(await controlSource(page)).toBe(null);
      expect(await deadZone(page)).toBe("0.16");
    }
  });

  test("a held limb's arrow buttons work by key, pointer and across a reconnect", async () => {
    const proxy = await fixture.proxy();
    const page = await open("Aiko", proxy.url);
    await pauseAtStart(page);
    await page.keyboard.press("KeyS");
    await page.getByRole("button", { name: "Take left hand" }).click();
    await waitForHold(page, LEFT_HAND);
    const pad = page.getByRole("group", { name: "Move the left hand" });
    expect(
      await pad.getByRole("button").evaluateAll((all) => all.map((button) => button.getAttribute("aria-label"))),
    ).toEqual(["Nearer", "Up", "Further", "Left", "Down", "Right"]);
    const wrist = await jointHeight(page, "l_wrist");
    await pad.getByRole("button", { name: "Up" }).focus();
    await page.keyboard.down("Space");
    // High enough to move down again below.
    await waitInEngine(page, leftWristMoved, { from: wrist, minimum: 0.15 });
    await page.keyboard.up("Space");
    await waitUntilStill(page);

    const raised = await jointHeight(page, "l_wrist");
    const down = pad.getByRole("button", { name: "Down" });
    await down.hover();
    await page.mouse.down();
    await waitInEngine(page, leftWristMoved, { from: raised, minimum: 0.05 });
    const before = proxy.webSocketCount;
    await waitForToast(page, "Connection lost, reconnecting", async () => proxy.cutWebSockets(/\/stream/));
    await expect.poll(() => proxy.webSocketCount).toBeGreaterThan(before);
    await expect.poll(() => page.getByRole("button", { name: "Release left hand" }).isEnabled()).toBe(true);
    expect(await down.getAttribute("data-on")).toBe("");
    await page.mouse.up();
    await waitUntilStill(page);
    expect(await page.getByRole("button", { name: "Play", exact: true }).isVisible()).toBe(true);
    await page.getByRole("button", { name: "Release left hand" }).click();
    await pad.waitFor({ state: "hidden" });
  });

  test("a gamepad stick controls a hand, and a bound button a leg", async () => {
    const before = (page: Page) =>
      page.addInitScript(() => {
        const buttons = Array.from({ length: 17 }, () => ({ pressed: false, touched: false, value: 0 }));
        Object.assign(window, {
          pad: { connected: true, mapping: "standard", id: "A pad (made for this)", axes: [0, 0, 0, 0], buttons },
        });
        navigator.getGamepads = () => [(window as unknown as { pad: Gamepad }).pad];
      });
    const page = await fixture.open("?name=Kiku", { ...REDUCED_MOTION, before });
    await waitUntilReady(page);
    await pauseAtStart(page);
    const wrist = await jointHeight(page, "l_wrist");
    await setGamepad(page, { axis: [1, -0.9] });
    await waitForHold(page, LEFT_HAND);
    await waitInEngine(page, leftWristMoved, { from: wrist, minimum: 0.05 });
    await setGamepad(page, { axis: [1, 0] });
    await waitForRelease(page, LEFT_HAND);

    await page.keyboard.press("Shift+Slash");
    await page.getByText("A pad is connected").waitFor();
    await page.getByText("The 14 inputs, one by one").click();
    await page.getByRole("button", { name: "Bind a key or button: right leg up" }).click();
    await setGamepad(page, {}); // Buttons that are already pressed are ignored.
    await setGamepad(page, { button: [1, 1] });
    await setGamepad(page, { button: [1, 0] });
    await page.getByRole("button", { name: "B: right leg up. Remove" }).waitFor();
    await page.keyboard.press("Escape");
    await setGamepad(page, { button: [1, 1] });
    await waitForHold(page, RIGHT_LEG);
  });

  test("a button and a key join two held hands and part them", async () => {
    const page = await open("Aiko");
    await stopDrawing(page);
    await page.getByRole("button", { name: "Strings", exact: true }).click();
    const join = page.getByRole("button", { name: "Join hands" });
    expect(await join.isVisible()).toBe(false);
    await tapKey(page, "Digit1");
    await tapKey(page, "Digit2");
    await waitForHold(page, LEFT_HAND);
    await waitForToast(page, "The hands are joined", () => join.click());
    await waitForToast(page, "The hands are apart again", () => page.keyboard.press("KeyJ"));
    expect(await controlSource(page)).toBe("velocity");
  });

  test("a limb is handed over on request, and the performance is recorded", async () => {
    const [aiko, mateo] = [await open("Aiko"), await open("Mateo")];
    // A puppeteer who does not answer loses the limb, so both pages must stay responsive.
    for (const page of [aiko, mateo]) await stopDrawing(page);
    await tapKey(aiko, "Digit2");
    await mateo.getByRole("button", { name: "Left hand, held by Aiko" }).waitFor();
    await waitForToast(mateo, "Aiko holds the left hand", () => tapKey(mateo, "Digit2"));
    expect(await controlSource(mateo)).toBe(null);
    await mateo.keyboard.press("KeyR");
    const request = aiko.getByText("Mateo asks for the left hand");
    await request.waitFor();
    await mateo.keyboard.press("KeyS");
    // Withdraw the request and ask again, in the panel.
    await mateo.getByRole("button", { name: "Withdraw the request for left hand" }).click();
    await request.waitFor({ state: "detached" });
    await mateo.getByRole("button", { name: "Ask for left hand" }).click();
    await request.waitFor();
    expect(await controlSource(aiko)).toBe("velocity");
    await aiko.keyboard.press("KeyG");
    await mateo.getByRole("button", { name: "Release left hand" }).waitFor();
    await waitForHold(mateo, LEFT_HAND);
    await aiko.getByRole("button", { name: "Left hand, held by Mateo" }).waitFor();
    expect([await controlSource(aiko), await controlSource(mateo)]).toEqual([null, "velocity"]);
    await request.waitFor({ state: "detached" });
    // One key records the performance, and the toast plays it.
    await clickInToast(aiko, "Dance it", () => aiko.keyboard.press("KeyK"));
    await aiko.locator(".brand-piece", { hasText: "as Aiko pulled it" }).waitFor();
    await mateo.locator(".brand-piece", { hasText: "as Aiko pulled it" }).waitFor();
  });
});

/** Wait for the first pose, the session's Welcome message and the paused state. */
async function waitUntilReady(page: Page): Promise<void> {
  await waitForFirstPose(page);
  await waitForWelcome(page);
  await page.getByRole("button", { name: "Play", exact: true }).waitFor();
}

/** Return the input that controls the left hand on a page. */
function controlSource(page: Page): Promise<string | null> {
  return evaluateInEngine(page, (limb) => globalThis.bunraku.hands.source(limb), LEFT_HAND);
}

/** Set an axis or a button of the page's gamepad and wait until it has been polled. */
async function setGamepad(page: Page, state: { axis?: [number, number]; button?: [number, number] }): Promise<void> {
  await page.evaluate(({ axis, button }) => {
    const { pad } = window as unknown as { pad: { axes: number[]; buttons: { pressed: boolean; value: number }[] } };
    if (axis) pad.axes[axis[0]] = axis[1];
    if (button) Object.assign(pad.buttons[button[0]], { value: button[1], pressed: button[1] > 0.5 });
  }, state);
  await waitForDraw(page);
}

/** Open the dialog of keys and return the value of the dead zone's slider. */
async function deadZone(page: Page): Promise<string> {
  await page.keyboard.press("Shift+Slash");
  const value = await page.getByRole("slider", { name: "Dead zone" }).inputValue();
  await page.keyboard.press("Escape");
  return value;
}

/** Return the height of a joint, in metres. */
async function jointHeight(page: Page, joint: string): Promise<number> {
  return (await jointPosition(page, joint))[1];
}

/** In the engine: return whether the left wrist has moved vertically by at least `minimum` metres. */
function leftWristMoved({ from, minimum }: { from: number; minimum: number }): boolean {
  const at = globalThis.bunraku.stage.scene.getObjectByName("l_wrist")?.matrixWorld.elements[13];
  return at !== undefined && Math.abs(at - from) >= minimum;
}

/** Wait until the left wrist does not move. */
async function waitUntilStill(page: Page): Promise<void> {
  await waitUntilSettled(page, async () => [await jointHeight(page, "l_wrist")], 1e-3);
}
