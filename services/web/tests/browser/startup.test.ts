import type { Page } from "playwright-core";
import { expect, test } from "vitest";
import { describeInBrowser } from "./browser-suite";
import { waitForFirstPose } from "./page-probe";

describeInBrowser("arriving", { demo: true }, ({ open }) => {
  test("the seal is seen first; a page whose stage is on its way shows itself, and what can wait comes after the puppet", async () => {
    const asked: string[] = [];
    let seen: Promise<string[]> | undefined;
    /** What the page asked for by the time that it can be used. */
    const usable = async (page: Page) => {
      await page.locator("main > .seal").waitFor();
      await page.getByRole("button", { name: "Library" }).waitFor();
      return [...asked];
    };
    const page = await open("", {
      before: async (page) => {
        page.on("request", (request) => void asked.push(new URL(request.url()).pathname));
        await page.route("**/stage-chunk-*.js", async (route) => {
          seen ??= usable(page);
          await seen.catch(() => undefined);
          await route.continue();
        });
      },
    });
    const late = [/inter-.*\.woff2/, /marionette-/, /sound-/];
    expect((await seen)?.filter((path) => late.some((what) => what.test(path)))).toEqual([]);
    await waitForFirstPose(page);
    await page.waitForFunction(() => !("arriving" in document.documentElement.dataset));
    expect(await page.locator("main > .seal").isVisible()).toBe(false);
    for (const what of late)
      await expect.poll(() => asked.some((path) => what.test(path)), { timeout: 30_000 }).toBe(true);
    // what is about the dancer has come, too
    await page.waitForFunction(
      () =>
        window.bunraku.stage.scene.getObjectByName("floor") && window.bunraku.stage.scene.getObjectByName("strings"),
    );
  });

  test("a page whose stage cannot be loaded says so, and is there all the same", async () => {
    const page = await open("", { before: (page) => page.route("**/stage-chunk-*.js", (route) => route.abort()) });
    await page.getByText("The renderer could not be loaded").waitFor();
    expect(await page.getByRole("button", { name: "Library" }).isVisible()).toBe(true);
    await page.locator(".people-count").waitFor();
  });
});
