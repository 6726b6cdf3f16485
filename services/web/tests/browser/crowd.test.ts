/** Limbs that are open to the audience: opened in the strings panel, pulled by several pages, and closed. */
import type { Page } from "playwright-core";
import { expect, test } from "vitest";
import { DESKTOP, findViolations, PHONE } from "./accessibility";
import { describeInBrowser, type OpenOptions } from "./browser-suite";
import { evaluateInEngine, waitInEngine } from "./engine-probe";
import {
  jointPosition,
  LEFT_HAND,
  pauseAtStart,
  ringPosition,
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

const RIGHT_HAND = 1;
const DRAGGABLE: OpenOptions = { viewport: { width: 760, height: 560 }, reducedMotion: "reduce" };
const TOUCH: OpenOptions = { viewport: { width: 360, height: 640 }, hasTouch: true, reducedMotion: "reduce" };

describeInBrowser("crowd", { server: "open" }, (fixture) => {
  /** Open a page of the test's session, which is paused and can be pulled. */
  async function open(options = DRAGGABLE): Promise<Page> {
    const page = await fixture.open("", options);
    await waitForFirstPose(page);
    await waitForWelcome(page);
    // Pages that render in software starve each other.
    await stopDrawing(page);
    return page;
  }

  const setCrowd = (crowd: Record<string, string | null>) =>
    fixture.request("PATCH", `/v1/sessions/${fixture.session}`, { crowd });

  test("a host opens a hand, a phone and a key pull it, the policy changes, and it is closed", async () => {
    const host = await open();
    await pauseAtStart(host);
    await showControls(host);
    await expect.poll(() => openLimbs(host)).toEqual([]);
    await waitForToast(host, "The left hand is open to the audience", () => limbButton(host, "Left hand").click());
    expect(await openLimbs(host)).toEqual(["Left hand"]);
    await host.getByRole("button", { name: "Pull left hand" }).waitFor();

    // Both join later.
    const [phone, keys] = [await open(TOUCH), await open()];
    for (const page of [phone, keys]) await waitForStatus(page, "Left hand Open to the audience");
    const before = (await jointPosition(host, "l_wrist"))[1];
    const drag = await touchRing(phone, LEFT_HAND);
    await drag(6, -40);
    await tapKey(keys, "Digit2");
    await waitForStatus(phone, "Left hand You and 1 other pull");
    await waitForStatus(keys, "Left hand You and 1 other pull");
    await waitForStatus(host, "Left hand 2 people pull");
    expect(await Promise.all([phone, keys].map((page) => holdOf(page, LEFT_HAND)))).toEqual([
      ["pointer", true, false],
      ["velocity", true, false],
    ]);
    await keys.keyboard.down("KeyW");
    await waitInEngine(
      host,
      (height) =>
        (globalThis.bunraku.stage.scene.getObjectByName("l_wrist")?.matrixWorld.elements[13] ?? 0) > height + 0.1,
      before,
    );
    await keys.keyboard.up("KeyW");

    const policy = host.getByRole("combobox", { name: "Many pulls become one by" });
    await policy.selectOption("Turns of 5 s");
    await expect
      .poll(async () => (await Promise.all([phone, keys].map(readStatus))).map((text) => / left/.test(text)))
      .toEqual([true, true]);
    await expect
      .poll(
        async () =>
          (await Promise.all([phone, keys].map(readStatus))).filter((text) => /Your turn, [1-5] s left/.test(text))
            .length,
      )
      .toBe(1);
    await policy.selectOption("Vote between gestures");
    await expect.poll(() => readStatus(host)).toMatch(/pull.*Votes: (up|down|across|to the (side|front)) [12]/);

    await waitForToast(phone, "The left hand is closed to the audience", () => limbButton(host, "Left hand").click());
    for (const page of [phone, keys]) {
      await waitForRelease(page, LEFT_HAND);
      await status(page).waitFor({ state: "hidden" });
    }
    expect(await openLimbs(host)).toEqual([]);
    // Now keys claim it again.
    await tapKey(keys, "Digit2");
    await waitForHold(keys, LEFT_HAND);
  });

  test("a puppeteer keeps a limb that is opened, and the controls work by keyboard", async () => {
    const page = await open();
    await tapKey(page, "Digit1");
    await waitForHold(page, RIGHT_HAND);
    await page.getByRole("button", { name: "Strings", exact: true }).click();
    await page.locator("details.crowd > summary").focus();
    await page.keyboard.press("Enter");
    await page.keyboard.press("Tab");
    await page.keyboard.press("Space");
    await expect.poll(() => openLimbs(page)).toEqual(["Right hand"]);
    expect(await page.getByRole("button", { name: "Release right hand" }).isVisible()).toBe(true);
    expect(await status(page).isVisible()).toBe(false);
    await page.getByRole("button", { name: "Release right hand" }).click();
    await waitForStatus(page, "Right hand Open to the audience");
    await page.getByRole("button", { name: "Pull right hand" }).click();
    await waitForStatus(page, "Right hand You pull");
    expect(await holdOf(page, RIGHT_HAND)).toEqual(["velocity", true, false]);
    await page.getByRole("group", { name: "Move the right hand" }).waitFor();
    await page.getByRole("button", { name: "Let go of right hand" }).click();
    await waitForRelease(page, RIGHT_HAND);
  });

  test("a gamepad pulls an open hand without a claim", async () => {
    await setCrowd({ left_hand: "median" });
    const page = await open({
      ...DRAGGABLE,
      before: (opened) =>
        opened.addInitScript(() => {
          const buttons = Array.from({ length: 17 }, () => ({ pressed: false, touched: false, value: 0 }));
          Object.assign(window, {
            pad: { connected: true, mapping: "standard", id: "A pad", axes: [0, 0, 0, 0], buttons },
          });
          navigator.getGamepads = () => [(window as unknown as { pad: Gamepad }).pad];
        }),
    });
    await waitForStatus(page, "Left hand Open to the audience");
    await page.evaluate(() => ((window as unknown as { pad: { axes: number[] } }).pad.axes[1] = -0.9));
    await waitForStatus(page, "Left hand You pull");
    expect(await holdOf(page, LEFT_HAND)).toEqual(["velocity", true, false]);
    await page.evaluate(() => ((window as unknown as { pad: { axes: number[] } }).pad.axes[1] = 0));
    await waitForRelease(page, LEFT_HAND);
  });

  test.each([
    ["desktop", DESKTOP],
    ["phone", PHONE],
  ] as const)("controls and status are accessible on a %s in both themes", async (_, viewport) => {
    await setCrowd({ left_hand: "vote", right_leg: "turns", left_leg: "turns" });
    const page = await open({ viewport, reducedMotion: "reduce" });
    await waitForStatus(page, "and 1 more limb");
    for (const colorScheme of ["dark", "light"] as const) {
      await page.emulateMedia({ colorScheme, reducedMotion: "reduce" });
      await waitForDraw(page);
      expect(await findViolations(page), colorScheme).toEqual([]);
      await page.getByRole("button", { name: "Strings", exact: true }).click();
      await expect.poll(() => openLimbs(page)).toEqual(["Left hand", "Right leg", "Left leg"]);
      await page.getByRole("button", { name: "Show a QR code" }).click();
      await page.getByRole("img", { name: "QR code of the link for the audience" }).waitFor();
      await waitForDraw(page);
      expect(await findViolations(page), `${colorScheme}, panel`).toEqual([]);
      await page.getByRole("button", { name: "Hide the QR code" }).click();
      await page.getByRole("button", { name: "Close strings" }).click();
    }
  });
});

describeInBrowser("crowd with links", { server: "guarded" }, (fixture) => {
  test("a viewer pulls an open hand, and is told why another does not move", async () => {
    const { link } = await fixture.request<{ link: string }>("POST", "/v1/shares", { session: fixture.session });
    const page = await fixture.open(link, DRAGGABLE);
    await waitForFirstPose(page);
    await stopDrawing(page);
    const refusal = "With this link you pull only what is open to the audience";
    await waitForToast(page, refusal, () => tapKey(page, "Digit2"));
    await fixture.request("PATCH", `/v1/sessions/${fixture.session}`, {
      playing: false,
      position: 0,
      crowd: { left_hand: "median" },
    });
    await waitForStatus(page, "Left hand Open to the audience");
    const ring = await waitUntilSettled(page, () => ringPosition(page, LEFT_HAND), 0.5);
    await page.mouse.move(ring.x, ring.y);
    await page.mouse.down();
    await waitForStatus(page, "Left hand You pull");
    await page.mouse.move(ring.x + 10, ring.y - 40, { steps: 4 });
    await waitInEngine(page, () => globalThis.bunraku.viewer.presence?.limbs[0] === "crowd");
    await page.mouse.up();
    await waitForRelease(page, LEFT_HAND);
    const other = await waitUntilSettled(page, () => ringPosition(page, RIGHT_HAND), 0.5);
    await waitForToast(page, refusal, () => page.mouse.click(other.x, other.y));
    expect(await page.getByRole("button", { name: "Strings", exact: true }).isVisible()).toBe(false);
    // The server enforces what the page does not offer.
    const answer = await page.evaluate(async (session) => {
      const headers = {
        "Content-Type": "application/json",
        Authorization: `Bearer ${sessionStorage.getItem("bunraku.token")}`,
      };
      const body = JSON.stringify({ crowd: { right_hand: "median" } });
      return (await fetch(`/v1/sessions/${session}`, { method: "PATCH", headers, body })).status;
    }, fixture.session);
    expect(answer).toBe(403);
  });
});

/** Open the strings panel and its controls of the audience. */
async function showControls(page: Page): Promise<void> {
  await page.getByRole("button", { name: "Strings", exact: true }).click();
  await page.getByText("Let the audience pull").click();
}

function limbButton(page: Page, name: string) {
  return page.getByRole("group", { name: "Open to the audience" }).getByRole("button", { name });
}

/** Return the names of the limbs that the controls show as open. */
function openLimbs(page: Page): Promise<string[]> {
  return page.locator(".crowd-limbs [aria-pressed=true]").allInnerTexts();
}

function status(page: Page) {
  return page.getByRole("region", { name: "The audience", exact: true });
}

/** Return the text of the status in one line. */
async function readStatus(page: Page): Promise<string> {
  return (await status(page).innerText()).replace(/\s+/g, " ");
}

async function waitForStatus(page: Page, text: string): Promise<void> {
  await status(page).waitFor();
  await expect.poll(() => readStatus(page)).toContain(text);
}

/** Return the input that pulls a limb on a page, whether it does with the crowd, and whether the page holds it. */
function holdOf(page: Page, limb: number): Promise<unknown> {
  return evaluateInEngine(
    page,
    (limb) => {
      const { hands, puppeteer } = globalThis.bunraku;
      return JSON.stringify([hands.source(limb), hands.isCrowdPull(limb), puppeteer.holds(limb)]);
    },
    limb,
  ).then((text) => JSON.parse(text));
}

/** Touch the ring of a limb, and return a function that moves the finger by pixels from there. */
async function touchRing(page: Page, limb: number): Promise<(x: number, y: number) => Promise<unknown>> {
  const ring = await waitUntilSettled(page, () => ringPosition(page, limb), 0.5);
  const protocol = await page.context().newCDPSession(page);
  const send = (type: "touchStart" | "touchMove", x: number, y: number) =>
    protocol.send("Input.dispatchTouchEvent", { type, touchPoints: [{ x: ring.x + x, y: ring.y + y }] });
  await send("touchStart", 0, 0);
  return (x, y) => send("touchMove", x, y);
}
