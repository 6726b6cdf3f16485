/**
 * The page under adverse conditions: no network, a lost WebGL context, hostile names, reduced motion and assistive
 * technology.
 */
import type { Page } from "playwright-core";
import { expect, test } from "vitest";
import { DESKTOP, findViolations, forEachState, PHONE } from "./accessibility";
import { describeInBrowser } from "./browser-suite";
import { createBowingBvh } from "./bvh-file";
import { evaluateInEngine, waitInEngine } from "./engine-probe";
import {
  LEFT_HAND,
  pauseAtStart,
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

/** Largest error of the motion's position, in seconds, if the clock is exact. */
const MAX_POSITION_ERROR_S = 0.1;
/** Largest error of the clock with which the position is measured. A busy machine answers pings late. */
const MAX_CLOCK_ERROR_S = 0.5;

describeInBrowser("resilience", { server: "open" }, (fixture) => {
  test("offline, the motion plays on; after reconnecting it is in sync", async () => {
    const proxy = await fixture.proxy();
    const page = await fixture.open(`${proxy.url}/?session=${fixture.session}`);
    await waitForFirstPose(page);
    await waitForWelcome(page);
    // The clock's error bound and unfinished slew limit the precision of the position: both may shrink later.
    const { clockError } = await waitInEngine(
      page,
      (maxError) => {
        const { clock } = globalThis.bunraku.viewer;
        const slew = Math.abs(clock.slewedOffset(1000 * performance.now()) - clock.offset);
        const clockError = (clock.errorBound + slew) / 1e6;
        return clockError < maxError ? { clockError } : null;
      },
      MAX_CLOCK_ERROR_S,
    );
    const start = await motionPosition(page);
    await waitForToast(page, "Connection lost, reconnecting", async () => proxy.setOffline(true));
    await page.locator('.health[data-state="lost"]').waitFor();
    expect(await page.getByRole("button", { name: "Take the left hand" }).isEnabled()).toBe(false);
    const cut = await motionPosition(page);
    // The buffer holds some seconds, in which the loop may restart.
    await waitInEngine(
      page,
      (from) => {
        const { viewer } = globalThis.bunraku;
        const elapsed = viewer.positionAt(performance.now()) - from;
        return elapsed - viewer.duration * Math.floor(elapsed / viewer.duration) > 1;
      },
      cut.position,
    );
    // A brief toast appears beside it and disappears.
    await waitForToast(page, "Reach for a string that someone else holds", () => page.keyboard.press("KeyR"));
    await page.getByText("Reach for a string that someone else holds").waitFor({ state: "detached" });
    expect(await page.getByText("Connection lost, reconnecting").isVisible()).toBe(true);
    const { webSocketCount } = proxy;
    proxy.setOffline(false);
    await page.locator('.health[data-state="good"]').waitFor();
    await page.getByText("Connection lost, reconnecting").waitFor({ state: "detached" });
    expect(proxy.webSocketCount).toBeGreaterThan(webSocketCount);
    await waitForWelcome(page);
    await expect.poll(() => page.getByRole("button", { name: "Take the left hand" }).isEnabled()).toBe(true);
    await waitInEngine(
      page,
      ({ start, maxError }) => {
        const { viewer } = globalThis.bunraku;
        const now = performance.now();
        const error = viewer.positionAt(now) - start.position - (now - start.now) / 1000;
        return Math.abs(error - viewer.duration * Math.round(error / viewer.duration)) < maxError;
      },
      { start, maxError: MAX_POSITION_ERROR_S + clockError },
    );
    await tapKey(page, "Digit2");
    await waitForHold(page, LEFT_HAND);
    await page.keyboard.press("Escape");
    await waitForRelease(page, LEFT_HAND);
  });

  test("names with markup, bidi controls or 200 letters are shown as text", async () => {
    const page = await fixture.open("", { viewport: DESKTOP });
    const dialogs: string[] = [];
    page.on("dialog", (dialog) => {
      dialogs.push(dialog.message());
      void dialog.dismiss();
    });
    await waitForFirstPose(page);
    for (const fileName of ["<img src=x onerror=alert(1)>", `\u202egnp.${"W".repeat(200)}`]) {
      const name = fileName.replace("\u202e", "").slice(0, 200);
      await page.setViewportSize(DESKTOP);
      const upload = (name: string, text: string) =>
        page
          .locator('input[type=file][accept*=".bvh"]')
          .setInputFiles({ name, mimeType: "text/plain", buffer: Buffer.from(text) });
      await upload(`${fileName}.bvh`, createBowingBvh(30 + name.length));
      await page.locator(".brand-piece", { hasText: name }).waitFor();
      expect(await page.locator(".motion[aria-current] b").textContent()).toBe(name);
      await upload(`${fileName}.txt.bvh`, "not a motion");
      await page.locator(".problem bdi", { hasText: `${fileName}.txt.bvh` }).waitFor();
      expect(await page.evaluate(overflowingElements)).toEqual([]);
      await page.getByRole("button", { name: `Remove ${name}` }).focus();
      await page.keyboard.press("Enter");
      await expect.poll(() => dialogs.length).toBe(1);
      expect(dialogs.pop()).toBe(`Remove "${name}" from the library?`);
      expect(await page.title()).toBe(`${name} - Bunraku`);
      await page.setViewportSize(PHONE);
      await page.getByRole("complementary", { name: "Library" }).waitFor({ state: "hidden" });
      await page.getByRole("button", { name: "Library", exact: true }).click();
      await waitForDraw(page);
      expect(await page.evaluate(overflowingElements)).toEqual([]);
    }
    expect(await page.locator("img:not(.motion-glyph > img)").count()).toBe(0);
    expect(dialogs).toEqual([]);
  });

  test("a lost WebGL context is reported, and its restored picture is the same", async () => {
    const consoleErrors: string[] = [];
    const page = await fixture.open("?quality=best", {
      viewport: { width: 260, height: 220 },
      colorScheme: "dark",
      reducedMotion: "reduce",
      before: async (page) =>
        void page.on("console", (message) => message.type() === "error" && consoleErrors.push(message.text())),
    });
    await waitForFirstPose(page);
    await pauseAtStart(page);
    await waitUntilSettled(page, () => cameraPosition(page), 1e-3);
    const before = await readFrame(page);
    expect(new Set(before).size).toBeGreaterThan(30);
    await loseAndRestoreContext(page);
    const after = await readFrame(page);
    const differing = after.filter((value, at) => Math.abs(value - before[at]) > 4).length;
    expect(differing / before.length).toBeLessThan(0.01);
    // three.js reports shader errors only on the console.
    expect(consoleErrors).toEqual([]);
  });

  test("a restored WebGL context clears only its own notice", async () => {
    const page = await fixture.open("?session=no-such-session", { viewport: { width: 260, height: 220 } });
    await page.getByText("The session has ended").waitFor();
    await waitInEngine(page, () => Boolean(globalThis.bunraku?.stage));
    await loseAndRestoreContext(page);
    expect(await page.getByText("The session has ended").isVisible()).toBe(true);
  });

  test("with reduced motion the session starts paused without transitions", async () => {
    // A page whose address names no session enters one that runs: here, as if there were no other tests.
    const page = await fixture.open("?session=", {
      reducedMotion: "reduce",
      before: (page) =>
        page.route("**/v1/sessions", async (route) => {
          const response = await route.fetch({ url: `${route.request().url()}?limit=200` });
          const { items } = (await response.json()) as { items: { id: string }[] };
          await route.fulfill({ response, json: { items: items.filter(({ id }) => id === fixture.session) } });
        }),
    });
    await waitForFirstPose(page);
    expect(new URL(page.url()).searchParams.get("session")).toBe(fixture.session);
    await page.getByRole("button", { name: "Play", exact: true }).waitFor();
    await page.keyboard.press("KeyS");
    await page.getByRole("complementary", { name: "Strings" }).waitFor();
    const animated = await page.evaluate(() =>
      [...document.querySelectorAll("*")]
        .filter((element) => {
          const { transitionProperty, transitionDuration, animationName } = getComputedStyle(element);
          return (
            (transitionProperty !== "none" && !/^(0s(, )?)*$/.test(transitionDuration)) || animationName !== "none"
          );
        })
        .map((element) => element.className),
    );
    expect(animated).toEqual([]);
    expect(await evaluateInEngine(page, () => globalThis.bunraku.stage.strings.reducedMotion)).toBe(true);
    // The timeline takes effect some time after it was received.
    await waitInEngine(page, () => {
      const { viewer } = globalThis.bunraku;
      return viewer.timelineHistory.at(viewer.presentationTime(performance.now()))?.playing === false;
    });
    const [first, second] = [await motionPosition(page), await waitForDraw(page).then(() => motionPosition(page))];
    expect(second.position).toBe(first.position);
  });

  test("axe-core finds no violations on a desktop and on a phone", async () => {
    const page = await fixture.open("", { reducedMotion: "reduce" });
    await waitForFirstPose(page);
    await waitForWelcome(page);
    // A held limb adds controls to the page.
    await tapKey(page, "Digit2");
    await waitForHold(page, LEFT_HAND);
    // axe-core reads the document, not the canvas.
    await stopDrawing(page);
    const found: string[] = [];
    for (const viewport of [DESKTOP, PHONE]) {
      await page.setViewportSize(viewport);
      await forEachState(
        page,
        async (state) =>
          void found.push(
            ...(await findViolations(page)).map((violation) => `${viewport.width} pixels, ${state}: ${violation}`),
          ),
      );
    }
    expect(found).toEqual([]);
  });
});

/** Return the stage's position in the motion, in seconds, and the page time, in milliseconds. */
function motionPosition(page: Page): Promise<{ position: number; now: number }> {
  return evaluateInEngine(page, () => {
    const now = performance.now();
    return { position: globalThis.bunraku.viewer.positionAt(now), now };
  });
}

/** Return the position of the audience's camera in metres. It follows the performer slowly. */
function cameraPosition(page: Page): Promise<[number, number, number]> {
  return evaluateInEngine(page, () => {
    const { elements } = globalThis.bunraku.stage.audience.camera.matrixWorld;
    return [elements[12], elements[13], elements[14]] as [number, number, number];
  });
}

/** In the page: return the elements that overflow their container or the window. */
function overflowingElements(): string[] {
  const visible = [
    ...document.querySelectorAll<HTMLElement>("header, .header-right, .brand, .transport, .panel, .panel *:not(svg *)"),
  ].filter((element) => element.getClientRects().length > 0);
  return visible
    .filter((element) => {
      const { left, right } = element.getBoundingClientRect();
      return (
        left < -1 ||
        right > innerWidth + 1 ||
        (element.matches(".panel, header") && element.scrollWidth > element.clientWidth + 1)
      );
    })
    .map((element) => `${element.tagName} ${element.className}`);
}

/** Return the RGBA bytes of the second frame from now: the first may still prepare resources. */
async function readFrame(page: Page): Promise<Uint8Array> {
  // As base64: an array of numbers takes Playwright seconds to transfer.
  const pixels = await evaluateInEngine(page, () => {
    const { renderer, scene, audience } = globalThis.bunraku.stage;
    // A canvas keeps its frame only until the end of the task that drew it.
    renderer.render(scene, audience.camera);
    const gl = renderer.getContext();
    const { drawingBufferWidth: width, drawingBufferHeight: height } = gl;
    const pixels = new Uint8Array(4 * width * height);
    gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
    return btoa(Array.from(pixels, (value) => String.fromCharCode(value)).join(""));
  });
  return Buffer.from(pixels, "base64");
}

/** Lose and restore the WebGL context, and wait for the page's notice to appear and disappear. */
async function loseAndRestoreContext(page: Page): Promise<void> {
  await evaluateInEngine(page, () => {
    const contextLoss = globalThis.bunraku.stage.renderer.getContext().getExtension("WEBGL_lose_context");
    Object.assign(globalThis, { contextLoss });
    contextLoss?.loseContext();
  });
  await page.getByText("The stage went dark").waitFor();
  await evaluateInEngine(page, () =>
    (globalThis as unknown as { contextLoss: WEBGL_lose_context }).contextLoss.restoreContext(),
  );
  await page.getByText("The stage went dark").waitFor({ state: "hidden" });
}
