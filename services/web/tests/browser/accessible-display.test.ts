/**
 * Layout for people who zoom, force colours or ask for more contrast or less data: controls neither overlap nor leave
 * the window, and show their borders, states and focus. Read from the document only.
 */
import type { Page } from "playwright-core";
import { expect, test } from "vitest";
import { findViolations } from "./accessibility";
import { describeInBrowser, type OpenOptions } from "./browser-suite";

/** Windows and their layout size at 200 % zoom. */
const WINDOWS = [
  [360, 640],
  [390, 844],
  [768, 1024],
  [1024, 768],
  [1440, 900],
] as const;

describeInBrowser("accessible display", { server: "open" }, (fixture) => {
  /** Open a page without its renderer: only the controls around the stage matter, and they are there sooner. */
  const open = (address: string, options: OpenOptions) =>
    fixture.open(address, {
      reducedMotion: "reduce",
      ...options,
      before: async (page) => {
        await page.route("**/stage-chunk*", (route) => route.abort());
        await options.before?.(page);
      },
    });

  test.each(WINDOWS)("nothing is wider than a window of %d by %d at 200 % zoom", async (width, height) => {
    const page = await open("", {
      viewport: { width: width / 2, height: height / 2 },
      deviceScaleFactor: 2,
    });
    await waitForControls(page);
    expect(await findControlProblems(page, 24)).toEqual([]);
    for (const name of ["Library", "Strings", "Connection"]) {
      await page.getByRole("button", { name, exact: true }).click();
      const panel = page.getByRole("complementary", { name });
      await panel.waitFor();
      expect(await findWideElements(page), name).toEqual([]);
      await page.getByRole("button", { name: `Close ${name.toLowerCase()}` }).click();
      await panel.waitFor({ state: "hidden" });
    }
  });

  test("controls of an upright phone stand apart, and leave the stage free", async () => {
    for (const [width, height] of [
      [360, 640],
      [390, 844],
    ] as const) {
      const page = await open("", {
        viewport: { width, height },
        hasTouch: true,
        isMobile: true,
      });
      await waitForControls(page);
      expect(await findControlProblems(page, 43.5), `${width} x ${height}`).toEqual([]);
      const bottomOf = async (selector: string) => {
        const box = await page.locator(selector).boundingBox();
        return (box?.y ?? 0) + (box?.height ?? 0);
      };
      const transportTop = (await page.locator(".transport").boundingBox())?.y ?? 0;
      expect(transportTop - (await bottomOf(".dock"))).toBeGreaterThan(8);
      // Between header and dock there is nothing but the stage.
      const dockTop = (await page.locator(".dock").boundingBox())?.y ?? 0;
      const headerBottom = await bottomOf(".header");
      const boxes = await controlBoxes(page);
      expect(boxes.filter(({ top, bottom }) => bottom > headerBottom + 1 && top < dockTop - 1)).toEqual([]);
      await page.close();
    }
  });

  test("panels cover neither each other nor the dock", async () => {
    for (const [width, height] of [
      [768, 1024],
      [1024, 600],
      [1440, 900],
    ] as const) {
      const page = await open("", { viewport: { width, height } });
      await waitForControls(page);
      for (const name of ["Library", "Connection", "Strings"]) {
        await page.getByRole("button", { name, exact: true }).click();
        await page.getByRole("complementary", { name }).waitFor();
        const overlapping = await page.evaluate(() => {
          const boxes = [...document.querySelectorAll<HTMLElement>(".panel, .dock, .transport, .header-right, .brand")]
            .filter((element) => element.checkVisibility())
            .map((element) => ({ name: element.className, box: element.getBoundingClientRect() }));
          return boxes.flatMap((one, index) =>
            boxes
              .slice(index + 1)
              .filter(
                ({ box }) =>
                  Math.min(box.right, one.box.right) - Math.max(box.left, one.box.left) > 0.5 &&
                  Math.min(box.bottom, one.box.bottom) - Math.max(box.top, one.box.top) > 0.5,
              )
              .map((other) => `${one.name} and ${other.name}`),
          );
        });
        expect(overlapping, `${width} x ${height}, ${name}`).toEqual([]);
      }
      await page.close();
    }
  });

  test("the title of a sheet stays in view while it scrolls", async () => {
    const page = await open("", { viewport: { width: 360, height: 640 } });
    await waitForControls(page);
    await page.getByRole("button", { name: "Library", exact: true }).click();
    const sheet = page.getByRole("complementary", { name: "Library" });
    await sheet.waitFor();
    await sheet.evaluate((element) => element.scrollTo(0, 100));
    const [sheetBox, close] = [
      await sheet.boundingBox(),
      await page.getByRole("button", { name: "Close library" }).boundingBox(),
    ];
    expect(close?.y).toBeGreaterThanOrEqual(sheetBox?.y ?? Infinity);
  });

  test.each(["dark", "light"] as const)("forced colours show borders, states and focus, %s", async (colorScheme) => {
    const page = await open("", { colorScheme, forcedColors: "active" });
    await waitForControls(page);
    await page.getByRole("button", { name: "Strings", exact: true }).click();
    await page.getByRole("complementary", { name: "Strings" }).waitFor();
    const styles = await page.evaluate(() => {
      const styleOf = (selector: string) => getComputedStyle(document.querySelector(selector) as Element);
      return {
        borders: [".play", ".limb-glyph", ".limb-action", ".panel", ".transport"].map(
          (selector) => styleOf(selector).borderTopStyle,
        ),
        pressed: styleOf('.pill[aria-expanded="true"]').backgroundColor,
        released: styleOf('.pill[aria-expanded="false"]').backgroundColor,
        played: styleOf(".seek-head").display,
        cells: styleOf(".seek i").forcedColorAdjust,
      };
    });
    expect(styles.borders).toEqual(Array(5).fill("solid"));
    expect(styles.pressed).not.toBe(styles.released);
    expect(styles.cells).toBe("none");
    await page.keyboard.press("Tab");
    const outline = await page.evaluate(() => {
      const { outlineStyle, outlineWidth } = getComputedStyle(document.activeElement as Element);
      return [outlineStyle, outlineWidth];
    });
    expect(outline).toEqual(["solid", "3px"]);
  });

  test.each(["dark", "light"] as const)(
    "more contrast has stronger lines and no violations, %s",
    async (colorScheme) => {
      const lineOf = async (contrast: "more" | "no-preference") => {
        const page = await open("", { colorScheme, contrast });
        await waitForControls(page);
        if (contrast === "more") expect(await findViolations(page)).toEqual([]);
        const line = await page.evaluate(() => getComputedStyle(document.documentElement).getPropertyValue("--line"));
        await page.close();
        return line;
      };
      expect(await lineOf("more")).not.toBe(await lineOf("no-preference"));
    },
  );

  test("the page starts with Save-Data on", async () => {
    const page = await open("", {
      extraHTTPHeaders: { "Save-Data": "on" },
      before: (page) =>
        page.addInitScript(() =>
          Object.defineProperty(navigator, "connection", {
            value: Object.assign(new EventTarget(), { saveData: true }),
          }),
        ),
    });
    await waitForControls(page);
  });
});

/** Wait until the controls are visible; without the renderer, those of limbs stay disabled. */
async function waitForControls(page: Page): Promise<void> {
  await page.locator(".play:enabled").waitFor();
  await page.locator(".dock button:not([hidden])").first().waitFor();
}

/** Return the boxes of the visible controls that are not in a panel, with their names. */
function controlBoxes(
  page: Page,
): Promise<{ name: string; left: number; top: number; right: number; bottom: number }[]> {
  return page.evaluate(() =>
    [...document.querySelectorAll<HTMLElement>("button, a, [role=slider], .times span")]
      .filter((element) => element.checkVisibility({ visibilityProperty: true }) && !element.closest(".panel, .tags"))
      .map((element) => {
        const { left, top, right, bottom } = element.getBoundingClientRect();
        return { name: element.ariaLabel || element.innerText || element.className, left, top, right, bottom };
      })
      .filter(({ left, right }) => right > left),
  );
}

/** Return descriptions of controls that overlap, are narrower than `minWidth` or leave the window. */
async function findControlProblems(page: Page, minWidth: number): Promise<string[]> {
  const boxes = await controlBoxes(page);
  const [width, height] = await page.evaluate(() => [innerWidth, innerHeight]);
  const controls = boxes.filter(({ name }) => !/^\d+:\d+$/.test(name));
  return [
    ...(await findWideElements(page)),
    ...controls
      .filter(({ left, right }) => right - left < minWidth)
      .map(({ name, left, right }) => `${name} is ${right - left} px wide`),
    ...boxes
      .filter(
        ({ left, top, right, bottom }) => left < -0.5 || top < -0.5 || right > width + 0.5 || bottom > height + 0.5,
      )
      .map(({ name }) => `${name} is out of the window`),
    ...boxes.flatMap((a, index) =>
      boxes
        .slice(index + 1)
        .filter(
          (b) =>
            Math.min(a.right, b.right) - Math.max(a.left, b.left) > 0.5 &&
            Math.min(a.bottom, b.bottom) - Math.max(a.top, b.top) > 0.5,
        )
        .map((b) => `${a.name} and ${b.name} overlap`),
    ),
  ];
}

/** Return the classes of visible elements that extend beyond the sides of the window. */
function findWideElements(page: Page): Promise<string[]> {
  return page.evaluate(() =>
    [...document.querySelectorAll<HTMLElement>("body *")]
      // The seek head is a layer as wide as its bar that moves to the right.
      .filter((element) => element.checkVisibility() && !element.closest("svg, .seek-head, .sr-only, .tags"))
      .filter((element) => {
        const { left, right } = element.getBoundingClientRect();
        return left < -0.5 || right > innerWidth + 0.5;
      })
      .map((element) => `${element.className || element.tagName} is wider than the window`),
  );
}
