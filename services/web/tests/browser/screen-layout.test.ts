/**
 * Layout in windows of many sizes: tags and toasts cover neither faces nor controls, and touch targets are large
 * enough.
 */
import type { Page } from "playwright-core";
import { expect, test } from "vitest";
import type { ScreenBox } from "../../src/stage/camera/screen-box";
import { describeInBrowser } from "./browser-suite";
import { evaluateInEngine, waitInEngine } from "./engine-probe";
import { tapKey, waitForDraw, waitForFirstPose, waitForHold, waitForToast, waitForWelcome } from "./page-probe";

/** Two phones in portrait and landscape orientation, and a low window. */
const WINDOWS = [
  [390, 844],
  [360, 640],
  [844, 390],
  [568, 320],
  [1024, 600],
] as const;
const LOW_WINDOW_PX = 500;

describeInBrowser("screen layout", { server: "open" }, ({ open }) => {
  test("tags of sixteen held limbs and toasts cover no face, bar or control", async () => {
    const page = await open("?name=Aiko", {
      viewport: { width: 390, height: 844 },
      hasTouch: true,
      reducedMotion: "reduce",
    });
    await waitForFirstPose(page);
    await waitForWelcome(page);
    await showFourPerformers(page);
    for (let performer = 0; performer < 4; performer++) {
      for (let limb = 0; limb < 4; limb++) await tapKey(page, `Digit${limb + 1}`);
      for (let limb = 0; limb < 4; limb++) await waitForHold(page, 4 * performer + limb);
      await page.keyboard.press("KeyT");
    }
    for (const [width, height] of WINDOWS) {
      await page.setViewportSize({ width, height });
      await waitForDraw(page);
      // Poll, because the new size takes some frames. In a low window the bars are at its top, with little room for
      // tags.
      const minTags = height < LOW_WINDOW_PX ? 1 : 5;
      await expect
        .poll(
          async () => {
            await reclaimLostLimbs(page);
            const { tagCount, covered } = await findCoveredElements(page);
            return tagCount < minTags ? [`only ${tagCount} tags`] : covered;
          },
          { message: `${width} x ${height}` },
        )
        .toEqual([]);
      await waitForToast(page, "Dancer", () => page.keyboard.press("KeyT"));
      // Add two permanent copies of the toast.
      await page.evaluate(() =>
        document
          .querySelector(".asks")
          ?.append(...[1, 2].map(() => document.querySelector(".toast")?.cloneNode(true) as Node)),
      );
      await expect
        .poll(async () => (await findCoveredElements(page)).covered, { message: `${width} x ${height}, with toasts` })
        .toEqual([]);
      await page.evaluate(() => document.querySelector(".asks")?.replaceChildren());
    }
  });

  test("on a phone the camera follows the selected performer above the panel", async () => {
    const page = await open("?name=Aiko", {
      viewport: { width: 390, height: 844 },
      hasTouch: true,
      reducedMotion: "reduce",
    });
    await waitForFirstPose(page);
    await showFourPerformers(page);
    const visibleFaces = async () => {
      const width = await page.evaluate(() => innerWidth);
      return (await stageBoxes(page)).faces.map(({ left, right }) => left > 0 && right < width);
    };
    // The third performer may be at the edge.
    await expect.poll(visibleFaces).toMatchObject({ 0: true, 1: true, 3: false });
    for (let number = 1; number <= 3; number++) await page.getByRole("button", { name: `Dancer ${number} of 4` }).tap();
    await expect.poll(visibleFaces).toMatchObject({ 0: false, 2: true, 3: true });
    await page.setViewportSize({ width: 360, height: 640 });
    await page.getByRole("button", { name: "Strings", exact: true }).tap();
    const sheet = page.getByRole("complementary", { name: "Strings" });
    await page.getByRole("button", { name: "Dancer 4", exact: true }).waitFor();
    // The feet are visible too.
    const floor = () =>
      evaluateInEngine(page, () => globalThis.bunraku.stage.toScreen(globalThis.bunraku.stage.rig.group.position).y);
    await expect.poll(async () => (await floor()) < ((await sheet.boundingBox())?.y ?? 0)).toBe(true);
  });

  test("in landscape, targets are large enough and panels beside the puppet", async () => {
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
      expect(await findTargetProblems(page), `${width} x ${height}`).toEqual([]);
      for (const [name, key] of [
        ["Library", "library"],
        ["Strings", "strings"],
        ["Connection", "line"],
      ]) {
        await page.getByRole("button", { name, exact: true }).tap();
        const panel = page.getByRole("complementary", { name });
        await expect.poll(async () => (await panel.boundingBox())?.x).toBeLessThan(width - 300);
        const box = await panel.boundingBox();
        expect([box?.y, Math.round((box?.x ?? 0) + (box?.width ?? 0)), box?.height]).toEqual([0, width, height]);
        await waitInEngine(
          page,
          (left) => globalThis.bunraku.stage.faceBoxes.every((face) => face.right < left),
          box?.x ?? 0,
        );
        expect(await findTargetProblems(page), `${width} x ${height}, ${name}`).toEqual([]);
        await page.getByRole("button", { name: `Close ${name.toLowerCase()}` }).tap();
        await panel.waitFor({ state: "hidden" });
        expect(await page.evaluate(() => (document.activeElement as HTMLElement).dataset.panel)).toBe(key);
      }
      await page.close();
    }
  });
});

/** Put four performers of the demo's motion on the stage. */
async function showFourPerformers(page: Page): Promise<void> {
  const motion = await evaluateInEngine(page, () => globalThis.bunraku.viewer.motion);
  await page.evaluate(async (motion) => {
    const request = async (method: string, path: string, body: object) => {
      const response = await fetch(path, {
        method,
        headers: { "Content-Type": "application/json" },
        body: JSON.stringify(body),
      });
      if (!response.ok) throw new Error(await response.text());
      return response.json();
    };
    const { id } = await request("POST", `/v1/motions/${motion}/performers`, { motions: [motion, motion, motion] });
    await request("PATCH", `/v1/sessions/${new URLSearchParams(location.search).get("session")}`, {
      motion: id,
      playing: false,
      position: 0,
    });
  }, motion);
  await waitInEngine(page, () => globalThis.bunraku.stage.performers.filter(({ group }) => group.visible).length === 4);
}

/** Claim the limbs that a page on a busy machine has lost, because it sent nothing for half a second. */
function reclaimLostLimbs(page: Page): Promise<void> {
  return evaluateInEngine(page, () => {
    const { hands } = globalThis.bunraku;
    for (let limb = 0; limb < 16; limb++) if (!hands?.source(limb)) hands?.claim(limb, "velocity");
  });
}

/** Return the boxes of the faces and of the control bars on the stage, in CSS pixels. */
function stageBoxes(page: Page): Promise<{ faces: ScreenBox[]; bars: ScreenBox[] }> {
  return evaluateInEngine(page, () => {
    const { stage } = globalThis.bunraku;
    const bars = Array.from({ length: 16 }, (_, limb) => stage.barBox(limb)).filter((bar) => bar !== null);
    return { faces: stage.faceBoxes, bars };
  });
}

/** Return the number of tags, and descriptions of the tags and toasts that cover something or leave the window. */
async function findCoveredElements(page: Page): Promise<{ tagCount: number; covered: string[] }> {
  return page.evaluate(
    (stage) => {
      const boxes = (selector: string) =>
        [...document.querySelectorAll(selector)]
          .map((element) => [selector, element.getBoundingClientRect()] as const)
          .filter(([, { width, height }]) => width > 0 && height > 0);
      const tags = boxes(".tag");
      const toasts = boxes(".toast");
      const faces = stage.faces.map((face) => ["face", face] as const);
      const bars = stage.bars.map((bar) => ["bar", bar] as const);
      const parts = boxes(".brand, .header-right, .transport, .dock, .camera, .picture, .sound");
      const problems: string[] = [];
      const check = (
        subjects: readonly (readonly [string, DOMRect])[],
        others: readonly (readonly [string, ScreenBox])[],
      ) => {
        for (const [name, a] of subjects) {
          if (a.left < 0 || a.top < 0 || a.right > innerWidth || a.bottom > innerHeight)
            problems.push(`${name} is out of the window`);
          for (const [other, b] of others) {
            if (a === b) continue;
            const overlaps =
              Math.min(a.right, b.right) - Math.max(a.left, b.left) > 0.5 &&
              Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top) > 0.5;
            if (overlaps) problems.push(`${name} covers ${other}`);
          }
        }
      };
      check(tags, [...tags, ...toasts, ...faces, ...bars, ...parts]);
      check(toasts, [...toasts, ...faces]);
      return { tagCount: tags.length, covered: problems };
    },
    await stageBoxes(page),
  );
}

/** Return descriptions of the controls that are too small for a finger, outside the window or overlapping. */
function findTargetProblems(page: Page): Promise<string[]> {
  return page.evaluate(() => {
    const all = [...document.querySelectorAll<HTMLElement>("button, a, input:not([type=range])")].filter((element) =>
      element.checkVisibility({ visibilityProperty: true }),
    );
    const open = document.querySelector(".panel:not([hidden])");
    // Skip controls that scroll within a panel, and those behind an open panel.
    const fixed = all
      .filter((element) => !element.closest(".panel") || element.closest(".panel-head"))
      .map((element) => ({
        name: element.ariaLabel || element.innerText || element.className,
        box: element.getBoundingClientRect(),
        panel: element.closest(".panel") !== null,
      }));
    const checked = fixed.filter(
      ({ box, panel }) => box.width > 0 && (!open || panel || box.right <= open.getBoundingClientRect().left),
    );
    return checked.flatMap(({ name, box }, nth) => {
      const overlapping = checked.filter(
        (other, index) =>
          index > nth &&
          Math.min(box.right, other.box.right) - Math.max(box.left, other.box.left) > 0.5 &&
          Math.min(box.bottom, other.box.bottom) - Math.max(box.top, other.box.top) > 0.5,
      );
      return [
        ...(box.width < 43.5 || box.height < 43.5 ? [`${name} is ${box.width} x ${box.height}`] : []),
        ...(box.left < 0 || box.top < 0 || box.right > innerWidth || box.bottom > innerHeight
          ? [`${name} is out of the window`]
          : []),
        ...overlapping.map((other) => `${name} and ${other.name} overlap`),
      ];
    });
  });
}
