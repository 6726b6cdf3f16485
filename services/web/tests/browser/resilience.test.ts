/** The page in a real browser under what it cannot help: eyes and ears of all kinds, no net, graphics that are taken away, names that mean ill. */
import type { Page, WebSocketRoute } from "playwright-core";
import { expect, test } from "vitest";
import { DESKTOP, findViolations, forEachState, PHONE } from "./accessibility";
import { describeInBrowser } from "./browser-suite";
import { createBowingBvh } from "./bvh-file";
import {
  LEFT_HAND,
  pauseAtStart,
  tapKey,
  waitForDraw,
  waitForFirstPose,
  waitForHold,
  waitForRelease,
  waitForToast,
  waitForWelcome,
  waitUntilSettled,
} from "./page-probe";

/** Seconds that the dance may be from where it has to be. */
const NEAR = 0.1;

describeInBrowser("a page under hardship", { demo: true }, (own) => {
  /** The session on the stage. */
  async function session(): Promise<{ id: string; viewers: number }> {
    const { items } = (await (await fetch(`${own.url}/v1/sessions`)).json()) as {
      items: { id: string; viewers: number }[];
    };
    return items[0];
  }

  test("without a net says so and dances on, and with one again is where the dance is", async () => {
    const lines: WebSocketRoute[] = [];
    const page = await own.open("", {
      before: (page) =>
        page.routeWebSocket(/\/v1\//, (line) => {
          line.connectToServer();
          lines.push(line);
        }),
    });
    await waitForFirstPose(page);
    await waitForWelcome(page);
    // where the dance is, is known as well as the time is: at first that is a guess, and the clock in use goes gently to what is known
    await page.waitForFunction((near) => {
      const { clock } = window.bunraku.viewer;
      return (
        Math.max(clock.errorBound, Math.abs(clock.slewedOffset(1000 * performance.now()) - clock.offset)) < 0.2e6 * near
      );
    }, NEAR);
    const begun = await whereabouts(page);
    await page.context().setOffline(true);
    await waitForToast(page, "Connection lost, reconnecting", async () => {
      for (const line of lines) await line.close({ code: 1012, reason: "cut by the test" });
    });
    await page.locator('.health[data-state="lost"]').waitFor();
    expect(await page.getByRole("button", { name: "Take the left hand" }).isEnabled()).toBe(false);
    const cut = await whereabouts(page);
    // it has some seconds in hand, and may begin anew in them
    await page.waitForFunction((from) => {
      const { viewer } = window.bunraku;
      const on = viewer.positionAt(performance.now()) - from;
      return on - viewer.duration * Math.floor(on / viewer.duration) > 1;
    }, cut.position);
    // what is said for a moment comes and goes beside it
    await waitForToast(page, "Reach for a string that someone else holds", () => page.keyboard.press("KeyR"));
    await page.getByText("Reach for a string that someone else holds").waitFor({ state: "detached" });
    expect(await page.getByText("Connection lost, reconnecting").isVisible()).toBe(true);
    const known = lines.length;
    await page.context().setOffline(false);
    await page.locator('.health[data-state="good"]').waitFor();
    await page.getByText("Connection lost, reconnecting").waitFor({ state: "detached" });
    expect(lines.length).toBeGreaterThan(known);
    await waitForWelcome(page);
    await expect.poll(() => page.getByRole("button", { name: "Take the left hand" }).isEnabled()).toBe(true);
    await page.waitForFunction(
      ({ begun, near }) => {
        const { viewer } = window.bunraku;
        const now = performance.now();
        const off = viewer.positionAt(now) - begun.position - (now - begun.now) / 1000;
        return Math.abs(off - viewer.duration * Math.round(off / viewer.duration)) < near;
      },
      { begun, near: NEAR },
    );
    await tapKey(page, "Digit2");
    await waitForHold(page, LEFT_HAND);
    await page.keyboard.press("Escape");
    await waitForRelease(page, LEFT_HAND);
  });

  test("shows names that mark up, or turn the line round and do not end, as names, and stays whole", async () => {
    const page = await own.open("", { viewport: DESKTOP });
    const asked: string[] = [];
    page.on("dialog", (dialog) => {
      asked.push(dialog.message());
      void dialog.dismiss();
    });
    await waitForFirstPose(page);
    for (const name of ["<img src=x onerror=alert(1)>", `\u202egnp.${"W".repeat(200)}`]) {
      await page.setViewportSize(DESKTOP);
      const upload = (called: string, text: string) =>
        page
          .locator('input[type=file][accept*=".bvh"]')
          .setInputFiles({ name: called, mimeType: "text/plain", buffer: Buffer.from(text) });
      await upload(`${name}.bvh`, createBowingBvh(30 + name.length));
      await page.locator(".brand-piece", { hasText: name }).waitFor();
      expect(await page.locator(".motion[aria-current] b").textContent()).toBe(name);
      await upload(`${name}.txt.bvh`, "no dance");
      await page.locator(".problem bdi", { hasText: `${name}.txt.bvh` }).waitFor();
      expect(await page.evaluate(sticksOut)).toEqual([]);
      await page.getByRole("button", { name: `Remove ${name}` }).focus();
      await page.keyboard.press("Enter");
      await expect.poll(() => asked.length).toBe(1);
      const isolated = name.startsWith("\u202e") ? `\u2068${name}\u2069` : name;
      expect(asked.pop()).toBe(`Remove "${isolated}" from the library?`);
      expect(await page.title()).toBe(`${isolated} - Bunraku`);
      await page.setViewportSize(PHONE);
      await page.getByRole("complementary", { name: "Library" }).waitFor({ state: "hidden" });
      await page.getByRole("button", { name: "Library", exact: true }).click();
      await waitForDraw(page);
      expect(await page.evaluate(sticksOut)).toEqual([]);
    }
    expect(await page.locator("img").count()).toBe(0);
    expect(asked).toEqual([]);
  });

  test("whose graphics were taken away says so, and has the same picture when they are back", async () => {
    const wrong: string[] = [];
    const page = await own.open("?quality=best", {
      viewport: { width: 260, height: 220 },
      colorScheme: "dark",
      reducedMotion: "reduce",
      before: async (page) => void page.on("console", (said) => said.type() === "error" && wrong.push(said.text())),
    });
    await waitForFirstPose(page);
    await pauseAtStart(page);
    await waitUntilSettled(page, () => seat(page), 1e-3);
    const before = await picture(page);
    expect(new Set(before).size).toBeGreaterThan(30);
    await darken(page);
    const after = await picture(page);
    const differing = after.filter((value, at) => Math.abs(value - before[at]) > 4).length;
    expect(differing / before.length).toBeLessThan(0.01);
    // of shaders that do not compile three.js tells the console alone
    expect(wrong).toEqual([]);
  });

  test("takes back what it said of its graphics when they are back, and nothing that it said of something else", async () => {
    const page = await own.open("?session=no-such-session", { viewport: { width: 260, height: 220 } });
    await page.getByText("The session has ended").waitFor();
    await page.waitForFunction(() => window.bunraku?.stage);
    await darken(page);
    expect(await page.getByText("The session has ended").isVisible()).toBe(true);
  });

  test("asked for less motion starts paused, and nothing glides", async () => {
    // so it does for who comes first, and not for others
    await expect.poll(async () => (await session()).viewers).toBe(0);
    const edit = {
      method: "PATCH",
      headers: { "Content-Type": "application/json" },
      body: JSON.stringify({ playing: true }),
    };
    expect((await fetch(`${own.url}/v1/sessions/${(await session()).id}`, edit)).status).toBe(200);
    const page = await own.open("", { reducedMotion: "reduce" });
    await waitForFirstPose(page);
    await page.getByRole("button", { name: "Play", exact: true }).waitFor();
    await page.keyboard.press("KeyS");
    await page.getByRole("complementary", { name: "Strings" }).waitFor();
    const gliding = await page.evaluate(() =>
      [...document.querySelectorAll("*")]
        .filter((one) => {
          const { transitionProperty, transitionDuration, animationName } = getComputedStyle(one);
          return (
            (transitionProperty !== "none" && !/^(0s(, )?)*$/.test(transitionDuration)) || animationName !== "none"
          );
        })
        .map((one) => one.className),
    );
    expect(gliding).toEqual([]);
    expect(await page.evaluate(() => window.bunraku.stage.strings.reducedMotion)).toBe(true);
    // told of, it takes effect a while later
    await page.waitForFunction(() => {
      const { viewer } = window.bunraku;
      return viewer.timelineHistory.at(viewer.presentationTime(performance.now()))?.playing === false;
    });
    const [one, other] = [await whereabouts(page), await waitForDraw(page).then(() => whereabouts(page))];
    expect(other.position).toBe(one.position);
  });

  test("has nothing that axe-core objects to, on a desktop and on a phone", async () => {
    const page = await own.open("", { reducedMotion: "reduce" });
    await waitForFirstPose(page);
    await waitForWelcome(page);
    // a held string has more to show
    await tapKey(page, "Digit2");
    await waitForHold(page, LEFT_HAND);
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

/** Where in the motion the stage is, seconds, and when, local milliseconds. */
function whereabouts(page: Page): Promise<{ position: number; now: number }> {
  return page.evaluate(() => {
    const now = performance.now();
    return { position: window.bunraku.viewer.positionAt(now), now };
  });
}

/** Where the audience sits, metres: it follows the dancer calmly. */
function seat(page: Page): Promise<[number, number, number]> {
  return page.evaluate(() => {
    const { elements } = window.bunraku.stage.audience.camera.matrixWorld;
    return [elements[12], elements[13], elements[14]] as [number, number, number];
  });
}

/** In the page: what is wider than what it stands in, or out of the window. */
function sticksOut(): string[] {
  const seen = [
    ...document.querySelectorAll<HTMLElement>("header, .header-right, .brand, .transport, .panel, .panel *:not(svg *)"),
  ].filter((one) => one.getClientRects().length > 0);
  return seen
    .filter((one) => {
      const { left, right } = one.getBoundingClientRect();
      return (
        left < -1 || right > innerWidth + 1 || (one.matches(".panel, header") && one.scrollWidth > one.clientWidth + 1)
      );
    })
    .map((one) => `${one.tagName} ${one.className}`);
}

/** Bytes of the next picture that is drawn once nothing more is made ready: red, green, blue and alpha. */
function picture(page: Page): Promise<number[]> {
  return page.evaluate(
    () =>
      new Promise<number[]>((told) => {
        const { stage } = window.bunraku;
        const { renderer } = stage;
        const render = renderer.render;
        let drawn = 0;
        renderer.render = (scene, camera) => {
          render.call(renderer, scene, camera);
          if (scene !== stage.scene || ++drawn < 2) return;
          renderer.render = render;
          const gl = renderer.getContext();
          const { drawingBufferWidth: width, drawingBufferHeight: height } = gl;
          const pixels = new Uint8Array(4 * width * height);
          gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
          told([...pixels]);
        };
      }),
  );
}

/** Takes the page's graphics away and gives them back, each once the page has said so. */
async function darken(page: Page): Promise<void> {
  await page.evaluate(() => {
    const lost = window.bunraku.stage.renderer.getContext().getExtension("WEBGL_lose_context");
    Object.assign(window, { lost });
    lost?.loseContext();
  });
  await page.getByText("The stage went dark").waitFor();
  await page.evaluate(() => (window as unknown as { lost: WEBGL_lose_context }).lost.restoreContext());
  await page.getByText("The stage went dark").waitFor({ state: "hidden" });
}
