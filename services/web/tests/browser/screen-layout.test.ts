/** In a real browser: with every string of four dancers held, and with messages, nothing covers a face, a bar or another name, in windows of every kind. */
import type { Page } from "playwright-core";
import { expect, test } from "vitest";
import { describeInBrowser } from "./browser-suite";
import { tapKey, waitForDraw, waitForFirstPose, waitForHold, waitForToast, waitForWelcome } from "./page-probe";

/** A phone, a small one, both on their side, and a low window. */
const WINDOWS = [
  [390, 844],
  [360, 640],
  [844, 390],
  [568, 320],
  [1024, 600],
] as const;

describeInBrowser("the room on the page", { demo: true, timeout: 300_000 }, ({ open }) => {
  test("names of sixteen held strings, and messages, cover no face, no bar and nothing of the page", async () => {
    const page = await open("?name=Aiko", {
      viewport: { width: 390, height: 844 },
      hasTouch: true,
      reducedMotion: "reduce",
    });
    await waitForFirstPose(page);
    await waitForWelcome(page);
    await fourDancers(page);
    for (let dancer = 0; dancer < 4; dancer++) {
      for (let limb = 0; limb < 4; limb++) await tapKey(page, `Digit${limb + 1}`);
      for (let limb = 0; limb < 4; limb++) await waitForHold(page, 4 * dancer + limb);
      await page.keyboard.press("KeyT");
    }
    for (const [width, height] of WINDOWS) {
      await page.setViewportSize({ width, height });
      await waitForDraw(page);
      // once the window is drawn in its new size
      await expect
        .poll(() => look(page), { message: `${width} x ${height}` })
        .toMatchObject({ shown: true, covered: [] });
      await waitForToast(page, "Dancer", () => page.keyboard.press("KeyT"));
      // two more stand as long as this is looked at
      await page.evaluate(() =>
        document
          .querySelector(".asks")
          ?.append(...[1, 2].map(() => document.querySelector(".toast")?.cloneNode(true) as Node)),
      );
      await expect
        .poll(async () => (await look(page)).covered, { message: `${width} x ${height}, messages` })
        .toEqual([]);
      await page.evaluate(() => document.querySelector(".asks")?.replaceChildren());
    }
  });

  test("on a phone the picture goes along to the dancer that is chosen, and stands over a sheet", async () => {
    const page = await open("?name=Aiko", {
      viewport: { width: 390, height: 844 },
      hasTouch: true,
      reducedMotion: "reduce",
    });
    await waitForFirstPose(page);
    await fourDancers(page);
    const seen = () =>
      page.evaluate(() => window.bunraku.stage.faceBoxes.map(({ left, right }) => left > 0 && right < innerWidth));
    // the one between may be at the edge
    await expect.poll(seen).toMatchObject({ 0: true, 1: true, 3: false });
    for (let to = 2; to <= 4; to++) await page.getByRole("button", { name: `Dancer ${to - 1} of 4` }).tap();
    await expect.poll(seen).toMatchObject({ 0: false, 2: true, 3: true });
    await page.setViewportSize({ width: 360, height: 640 });
    await page.getByRole("button", { name: "Strings", exact: true }).tap();
    const sheet = page.getByRole("complementary", { name: "Strings" });
    await page.getByRole("button", { name: "Dancer 4", exact: true }).waitFor();
    // feet and all
    const floor = () => page.evaluate(() => window.bunraku.stage.toScreen(window.bunraku.stage.rig.group.position).y);
    await expect.poll(async () => (await floor()) < ((await sheet.boundingBox())?.y ?? 0)).toBe(true);
  });

  test("a phone on its side has all within reach of a finger, and its panels beside the puppet", async () => {
    for (const [width, height] of [
      [844, 390],
      [667, 375],
      [568, 320],
    ]) {
      const page = await open("?name=Aiko", {
        viewport: { width, height },
        hasTouch: true,
        isMobile: true,
        reducedMotion: "reduce",
      });
      await waitForFirstPose(page);
      await waitForWelcome(page);
      expect(await targets(page), `${width} x ${height}`).toEqual([]);
      for (const name of ["Library", "Strings", "Connection"]) {
        await page.getByRole("button", { name, exact: true }).tap();
        const panel = page.getByRole("complementary", { name });
        await expect.poll(async () => (await panel.boundingBox())?.x).toBeLessThan(width - 300);
        const box = await panel.boundingBox();
        expect([box?.y, Math.round((box?.x ?? 0) + (box?.width ?? 0)), box?.height]).toEqual([0, width, height]);
        await page.waitForFunction(
          (left) => window.bunraku.stage.faceBoxes.every((face) => face.right < left),
          box?.x ?? 0,
        );
        expect(await targets(page), `${width} x ${height}, ${name}`).toEqual([]);
        await page.getByRole("button", { name: `Close ${name.toLowerCase()}` }).tap();
        await panel.waitFor({ state: "hidden" });
        expect(await page.evaluate(() => (document.activeElement as HTMLElement).dataset.panel)).toBe(
          name.toLowerCase(),
        );
      }
      await page.close();
    }
  });
});

/** Puts our own dance on the stage four times, if a test before has not. */
async function fourDancers(page: Page): Promise<void> {
  await page.evaluate(async () => {
    const ask = async (method: string, path: string, body: object) => {
      const answer = await fetch(path, {
        method,
        headers: { "Content-Type": "application/json" },
        body: JSON.stringify(body),
      });
      if (!answer.ok) throw new Error(await answer.text());
      return answer.json();
    };
    const { motion, performers } = window.bunraku.viewer;
    if (performers.length === 4) return;
    const { id } = await ask("POST", `/v1/motions/${motion}/performers`, { motions: [motion, motion, motion] });
    await ask("PATCH", `/v1/sessions/${new URLSearchParams(location.search).get("session")}`, {
      motion: id,
      playing: false,
      position: 0,
    });
  });
  await page.waitForFunction(() => window.bunraku.stage.performers.filter(({ group }) => group.visible).length === 4);
}

/** Whether names are shown, and what of names and messages covers what it must not, in words. */
function look(page: Page): Promise<{ shown: boolean; covered: string[] }> {
  return page.evaluate(() => {
    const { stage } = window.bunraku;
    const boxes = (selector: string) =>
      [...document.querySelectorAll(selector)]
        .map((one) => [selector, one.getBoundingClientRect()] as const)
        .filter(([, { width, height }]) => width > 0 && height > 0);
    const names = boxes(".tag");
    const messages = boxes(".toast");
    const faces = stage.faceBoxes.map((face) => ["face", face] as const);
    const bars = Array.from({ length: 16 }, (_, limb) => ["bar", stage.barBox(limb)] as const).filter(
      ([, bar]) => bar !== null,
    );
    const parts = boxes(".brand, .header-right, .transport, .dock, .camera, .picture, .sound");
    const found: string[] = [];
    const among = (
      some: readonly (readonly [string, DOMRect])[],
      others: readonly (readonly [string, { left: number; top: number; right: number; bottom: number } | null])[],
    ) => {
      for (const [what, a] of some) {
        if (a.left < 0 || a.top < 0 || a.right > innerWidth || a.bottom > innerHeight)
          found.push(`${what} is out of the window`);
        for (const [other, b] of others) {
          if (!b || a === b) continue;
          const over =
            Math.min(a.right, b.right) - Math.max(a.left, b.left) > 0.5 &&
            Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top) > 0.5;
          if (over) found.push(`${what} covers ${other}`);
        }
      }
    };
    among(names, [...names, ...messages, ...faces, ...bars, ...parts]);
    among(messages, [...messages, ...faces]);
    return { shown: names.length > 4, covered: found };
  });
}

/** What can be pressed and is smaller than a finger, out of the window, or over another, in words. */
function targets(page: Page): Promise<string[]> {
  return page.evaluate(() => {
    const all = [...document.querySelectorAll<HTMLElement>("button, a, input:not([type=range])")].filter((one) =>
      one.checkVisibility({ visibilityProperty: true }),
    );
    const open = document.querySelector(".panel:not([hidden])");
    // what scrolls within a panel, and what a panel stands before, is not looked at
    const fixed = all
      .filter((one) => !one.closest(".panel") || one.closest(".panel-head"))
      .map((one) => ({
        name: one.ariaLabel || one.innerText || one.className,
        box: one.getBoundingClientRect(),
        panel: one.closest(".panel") !== null,
      }));
    const seen = fixed.filter(
      ({ box, panel }) => box.width > 0 && (!open || panel || box.right <= open.getBoundingClientRect().left),
    );
    return seen.flatMap(({ name, box }, nth) => {
      const over = seen.filter(
        (other, k) =>
          k > nth &&
          Math.min(box.right, other.box.right) - Math.max(box.left, other.box.left) > 0.5 &&
          Math.min(box.bottom, other.box.bottom) - Math.max(box.top, other.box.top) > 0.5,
      );
      return [
        ...(box.width < 43.5 || box.height < 43.5 ? [`${name} is ${box.width} x ${box.height}`] : []),
        ...(box.left < 0 || box.top < 0 || box.right > innerWidth || box.bottom > innerHeight
          ? [`${name} is out of the window`]
          : []),
        ...over.map((other) => `${name} and ${other.name} overlap`),
      ];
    });
  });
}
