/** Files dropped on the page. */
import type { Page } from "playwright-core";
import { expect, test } from "vitest";
import { writeVrma } from "../../src/export/vrma";
import { goldenMotion, joinParts, runToCompletion } from "../export/motions";
import { findViolations } from "./accessibility";
import { describeInBrowser } from "./browser-suite";
import { createBowingBvh } from "./bvh-file";

const MOTION = createBowingBvh(50);

describeInBrowser("file drop", { server: "open" }, ({ open }) => {
  test("a file dropped on the page is uploaded and played", async () => {
    const page = await open("", { viewport: { width: 500, height: 400 }, reducedMotion: "reduce" });
    await page.getByRole("button", { name: "Library", exact: true }).click();
    await page.getByRole("complementary", { name: "Library" }).waitFor();
    await page.evaluate(dispatchDrag, { type: "dragover", name: "dropped.bvh", text: MOTION });
    await page.locator(".drop-frame").waitFor();
    await page.evaluate(dispatchDrag, { type: "drop", name: "dropped.bvh", text: MOTION });
    await page.locator(".drop-frame").waitFor({ state: "hidden" });
    await page.locator(".brand-piece", { hasText: "dropped" }).waitFor({ state: "attached" });
    expect(await page.locator(".problem").count()).toBe(0);
    const stored = await page.evaluate(
      async () => (await (await fetch("/v1/motions")).json()) as { items: { filename: string }[] },
    );
    expect(stored.items.map(({ filename }) => filename)).toContain("dropped.bvh");
  });

  test("a GLB file with an animation is a motion, not an avatar", async () => {
    const file = new Uint8Array(await joinParts(runToCompletion(writeVrma(goldenMotion(), "waltz"))));
    const page = await open("", { viewport: { width: 390, height: 700 }, reducedMotion: "reduce" });
    await page.getByRole("button", { name: "Library", exact: true }).waitFor();
    await page.evaluate(dispatchDrag, { type: "drop", name: "waltz.glb", bytes: [...file] });
    await page.locator(".brand-piece", { hasText: "waltz" }).waitFor({ state: "attached" });
    expect(await page.locator(".problem").count()).toBe(0);
  });

  test("several files are a queue: bad ones are named, all can be cancelled, by keyboard on a phone", async () => {
    const page = await open("", { viewport: { width: 390, height: 844 }, reducedMotion: "reduce" });
    await page.getByRole("button", { name: "Library", exact: true }).waitFor();
    // Each upload waits until the test lets it go on.
    const release = await holdUploads(page);
    const encoder = new TextEncoder();
    const files = ["queue-one.bvh", "queue-two.bvh", "queue-three.bvh", "queue-four.bvh"].map(
      (name, number): [string, number[]] => [
        name,
        [...encoder.encode(name === "queue-two.bvh" ? "no dance" : createBowingBvh(131 + number))],
      ],
    );
    await page.evaluate(dispatchDrag, { type: "drop", files });
    const summary = page.getByRole("progressbar", { name: "All uploads" });
    await summary.waitFor();
    expect(await summary.getAttribute("aria-valuetext")).toBe("File 1 of 4, 0%");
    expect(await findViolations(page)).toEqual([]);
    // Cancels a waiting file by keyboard; its neighbour gets the focus.
    await page.getByRole("button", { name: "Cancel the upload of queue-three.bvh" }).focus();
    await page.keyboard.press("Enter");
    expect(await page.evaluate(() => document.activeElement?.getAttribute("aria-label"))).toBe(
      "Cancel the upload of queue-four.bvh",
    );
    await expect.poll(() => summary.getAttribute("aria-valuetext")).toBe("File 1 of 3, 0%");
    release();
    await page.locator(".problem", { hasText: "queue-two.bvh" }).waitFor();
    await page.locator(".motion", { hasText: "queue-four" }).waitFor();
    await page.locator(".motion", { hasText: "queue-one" }).waitFor();
    expect(await page.locator(".motion", { hasText: "queue-three" }).count()).toBe(0);
    await page.locator(".upload").waitFor({ state: "detached" });
    await page.locator(".problem").getByRole("button", { name: "Dismiss" }).press("Enter");
    expect(await page.evaluate(() => document.activeElement?.className)).toBe("drop");
    const again = await holdUploads(page);
    await page.evaluate(dispatchDrag, { type: "drop", files });
    await page.getByRole("button", { name: "Cancel all uploads" }).press("Enter");
    await page.locator(".upload").first().waitFor({ state: "detached" });
    expect(await page.evaluate(() => document.activeElement?.className)).toBe("drop");
    again();
  });
});

/** Hold back the answers to uploads of a page; return the function that lets them go on. */
async function holdUploads(page: Page): Promise<() => void> {
  let release = () => {};
  const released = new Promise<void>((resolve) => {
    release = resolve;
  });
  await page.route("**/v1/motions?filename=*", async (route) => {
    await released;
    // The page may have cancelled the request.
    await route.continue().catch(() => undefined);
  });
  return release;
}

/** In the page: dispatch a drag event with files on the stage. */
function dispatchDrag({
  type,
  ...files
}: { type: string } & ({ name: string; text?: string; bytes?: number[] } | { files: [string, number[]][] })): void {
  const dataTransfer = new DataTransfer();
  const dragged: [string, string | Uint8Array<ArrayBuffer>][] =
    "files" in files
      ? files.files.map(([name, bytes]) => [name, new Uint8Array(bytes)])
      : [[files.name, files.text ?? new Uint8Array(files.bytes ?? [])]];
  for (const [name, content] of dragged) dataTransfer.items.add(new File([content], name));
  const event = new DragEvent(type, { dataTransfer, bubbles: true, cancelable: true });
  document.querySelector("#stage")?.dispatchEvent(event);
  if (!event.defaultPrevented) throw new Error(`The page did not handle ${type}: the browser would open the file`);
}
