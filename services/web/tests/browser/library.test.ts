/** Library panel: search, pictures, names and tags in place, and edited copies, by mouse, keyboard and touch. */
import type { Page } from "playwright-core";
import { expect, test } from "vitest";
import { findViolations } from "./accessibility";
import { type BrowserFixture, describeInBrowser } from "./browser-suite";
import { createBowingBvh } from "./bvh-file";

/** A phone, and a tall window with a mouse. */
const PHONE = {
  viewport: { width: 390, height: 844 },
  hasTouch: true,
  isMobile: true,
  reducedMotion: "reduce",
} as const;
const DESKTOP = { viewport: { width: 900, height: 800 }, reducedMotion: "reduce" } as const;

interface StoredMotion {
  id: string;
  name: string;
  tags: string[];
}

/** Upload a motion of this many frames, with a name of its own. */
function upload({ request }: BrowserFixture, name: string, frames: number): Promise<StoredMotion> {
  return request("POST", `/v1/motions?filename=${encodeURIComponent(`${name}.bvh`)}`, createBowingBvh(frames));
}

async function openLibrary(page: Page): Promise<void> {
  await page.getByRole("button", { name: "Library", exact: true }).click();
  await page.getByRole("searchbox", { name: "Search the library" }).waitFor();
}

/** Return the list entry of the motion with this name. */
function entry(page: Page, name: string) {
  return page.locator(".motions li").filter({ has: page.locator(".motion b", { hasText: new RegExp(`^${name}$`) }) });
}

const names = (page: Page) => page.locator(".motion b").allInnerTexts();

describeInBrowser("library", { server: "open" }, (fixture) => {
  const { open } = fixture;

  test("search finds words of the name by keyboard and says when there is nothing", async () => {
    await upload(fixture, "Heron by the RIVER", 61);
    await upload(fixture, "Heron in snow", 62);
    const page = await open("", DESKTOP);
    await openLibrary(page);
    const field = page.getByRole("searchbox", { name: "Search the library" });
    await field.focus();
    // These letters are keys of limbs, and the field keeps them.
    await page.keyboard.type("river HERON");
    await expect.poll(() => names(page)).toEqual(["Heron by the RIVER"]);
    await expect.poll(() => page.getByRole("status").filter({ hasText: "1 found" }).count()).toBe(1);
    await page.keyboard.type(" %");
    await page.getByText('Nothing found for "river HERON %"').waitFor();
    expect(await names(page)).toEqual([]);
    expect(await findViolations(page)).toEqual([]);
    // Escape clears the search, then closes the panel.
    await page.keyboard.press("Escape");
    await expect.poll(() => names(page)).toContain("Heron in snow");
    expect(await field.inputValue()).toBe("");
    await page.keyboard.press("Escape");
    await page.getByRole("complementary", { name: "Library" }).waitFor({ state: "hidden" });
  });

  test("pictures are loaded when the library is opened and they are in view", async () => {
    const { id } = await upload(fixture, "Egret", 63);
    const requests: string[] = [];
    const page = await open("", {
      ...DESKTOP,
      before: async (page) =>
        page.on("request", (request) => {
          if (request.url().endsWith("/thumbnail")) requests.push(request.url());
        }),
    });
    await page.getByRole("button", { name: "Library", exact: true }).waitFor();
    await page.locator(".motions li").first().waitFor({ state: "attached" });
    expect(requests).toEqual([]);
    await openLibrary(page);
    const picture = entry(page, "Egret").locator(".motion-glyph img");
    await picture.scrollIntoViewIfNeeded();
    await expect.poll(() => picture.evaluate((image: HTMLImageElement) => image.naturalWidth)).toBeGreaterThan(0);
    // The list is rendered again, and the picture is kept.
    await page.getByRole("searchbox").fill("egret");
    await expect.poll(() => names(page)).toEqual(["Egret"]);
    expect(await entry(page, "Egret").locator("img").count()).toBe(1);
    expect(requests.filter((url) => url.includes(id))).toHaveLength(1);
  });

  test("name and tags are changed in place", async () => {
    const { id } = await upload(fixture, "Stork", 271);
    const page = await open("", DESKTOP);
    await openLibrary(page);
    await page.getByRole("searchbox").fill("stork");
    await expect.poll(() => names(page)).toEqual(["Stork"]);
    await entry(page, "Stork").hover();
    await page.getByRole("button", { name: "Edit Stork", exact: true }).click();
    const nameField = page.getByRole("textbox", { name: "Name" });
    await nameField.fill("  Black stork ");
    await page.keyboard.press("Enter");
    await expect.poll(() => names(page)).toEqual(["Black stork"]);
    // The editor stays open and keeps the focus.
    expect(await nameField.evaluate((field) => field === document.activeElement)).toBe(true);
    const tagField = page.getByRole("textbox", { name: "Add a tag" });
    await tagField.fill("slow");
    await page.keyboard.press("Enter");
    await tagField.fill("one leg");
    await page.keyboard.press("Enter");
    await page.locator(".motion-tags", { hasText: "slow \u00b7 one leg" }).waitFor();
    await page.getByRole("button", { name: "Remove the tag slow" }).click();
    await page.locator(".motion-tags", { hasText: /^one leg$/ }).waitFor();
    expect(await fixture.request<StoredMotion>("GET", `/v1/motions/${id}`)).toMatchObject({
      name: "Black stork",
      tags: ["one leg"],
    });
    expect(await findViolations(page)).toEqual([]);
    // A tag is a filter.
    await page.getByRole("searchbox").fill("");
    const filter = page.getByRole("search").getByRole("button", { name: "one leg" });
    await filter.click();
    await expect.poll(() => names(page)).toEqual(["Black stork"]);
    expect(await filter.getAttribute("aria-pressed")).toBe("true");
    await filter.click();
    await expect.poll(async () => (await names(page)).length).toBeGreaterThan(1);
    // Escape closes the editor and not the panel.
    await nameField.focus();
    await page.keyboard.press("Escape");
    await nameField.waitFor({ state: "detached" });
    expect(await page.getByRole("complementary", { name: "Library" }).isVisible()).toBe(true);
  });

  test("name that the server refuses is taken back, and the problem is shown", async () => {
    await upload(fixture, "Ibis", 65);
    const page = await open("", DESKTOP);
    await openLibrary(page);
    await page.getByRole("searchbox").fill("ibis");
    await expect.poll(() => names(page)).toEqual(["Ibis"]);
    await entry(page, "Ibis").hover();
    await page.getByRole("button", { name: "Edit Ibis", exact: true }).click();
    const nameField = page.getByRole("textbox", { name: "Name" });
    // Only an invisible character.
    await nameField.fill("\u2060");
    await page.keyboard.press("Enter");
    await page.locator(".problem", { hasText: "Ibis" }).waitFor();
    await expect.poll(() => nameField.inputValue()).toBe("Ibis");
  });

  test("a part, mirrored and looped, becomes a new motion on the stage", async () => {
    const { id } = await upload(fixture, "Crane", 272);
    const page = await open("", DESKTOP);
    await openLibrary(page);
    await page.getByRole("searchbox").fill("crane");
    await expect.poll(() => names(page)).toEqual(["Crane"]);
    await entry(page, "Crane").hover();
    await page.getByRole("button", { name: "Edit Crane", exact: true }).click();
    const make = page.getByRole("button", { name: "Make a new dance" });
    expect(await make.isDisabled()).toBe(true);
    const [from, to] = [page.getByRole("slider", { name: "From" }), page.getByRole("slider", { name: "To" })];
    await from.fill("0.5");
    await to.fill("2");
    expect(await from.getAttribute("aria-valuetext")).toBe("0.50 s");
    // A slider pushes the other one.
    await from.fill("2.5");
    expect(Number(await to.inputValue())).toBeGreaterThan(2.5);
    await to.fill("2");
    await from.fill("0.5");
    await page.getByRole("checkbox", { name: "Mirror left and right" }).check();
    await page.getByRole("checkbox", { name: "Seamless loop" }).check();
    await make.click();
    await page.locator(".brand-piece", { hasText: "Crane, cut, mirrored, loop" }).waitFor();
    await expect.poll(() => names(page)).toEqual(["Crane, cut, mirrored, loop", "Crane"]);
    const { items } = await fixture.request<{ items: Record<string, unknown>[] }>(
      "GET",
      "/v1/motions?search=crane+loop",
    );
    expect(items).toHaveLength(1);
    expect(items[0]).toMatchObject({ made_from: id, frames: 45 });
    expect(await page.locator(".upload, .problem").count()).toBe(0);
  });

  test("everything fits on a phone and can be touched", async () => {
    await upload(fixture, "A heron with a very long name that needs several lines of text", 66);
    await fixture.request("PATCH", `/v1/motions/${(await upload(fixture, "Bittern", 67)).id}`, {
      tags: ["t".repeat(40)],
    });
    const page = await open("", PHONE);
    await openLibrary(page);
    await entry(page, "Bittern").locator(".motion-edit").tap();
    await page.getByRole("button", { name: "Make a new dance" }).scrollIntoViewIfNeeded();
    const panel = page.getByRole("complementary", { name: "Library" });
    expect(await panel.evaluate((element) => element.scrollWidth - element.clientWidth)).toBe(0);
    const small = await panel.evaluate((element) =>
      [...element.querySelectorAll<HTMLElement>("button, .text-field, input[type=range], label:has([type=checkbox])")]
        .filter((control) => control.checkVisibility())
        .map((control) => ({ control, box: control.getBoundingClientRect() }))
        .filter(({ box }) => box.width < 43.5 || box.height < 43.5)
        .map(({ control }) => control.outerHTML.slice(0, 80)),
    );
    expect(small).toEqual([]);
    // Buttons of a motion do not cover its name.
    const covered = await panel.evaluate(
      (element) =>
        [...element.querySelectorAll(".motions li")].filter((item) => {
          const name = item.querySelector("b")!.getBoundingClientRect();
          const tools = item.querySelector(".motion-tools")!.getBoundingClientRect();
          return name.right > tools.left && name.bottom > tools.top && name.top < tools.bottom;
        }).length,
    );
    expect(covered).toBe(0);
    expect(await findViolations(page)).toEqual([]);
  });
});

describeInBrowser("library of a puppeteer", { server: "guarded" }, (fixture) => {
  test("a token that may not store motions searches and sees pictures, but edits nothing", async () => {
    const { id } = await upload(fixture, "Spoonbill", 68);
    const page = await fixture.open(`#token=${fixture.tokens?.control}`, DESKTOP);
    await openLibrary(page);
    await page.getByRole("searchbox").fill("spoon");
    await expect.poll(() => names(page)).toEqual(["Spoonbill"]);
    await entry(page, "Spoonbill").locator(".motion-glyph img").waitFor();
    expect(await page.getByRole("button", { name: /^Edit / }).count()).toBe(0);
    await fixture.request("DELETE", `/v1/motions/${id}`);
  });
});
