/** Files dropped on the page. */
import { expect, test } from "vitest";
import { writeVrma } from "../../src/export/vrma";
import { goldenMotion, joinParts, runToCompletion } from "../export/motions";
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
});

/** In the page: dispatch a drag event with a file on the stage. */
function dispatchDrag({
  type,
  name,
  text,
  bytes,
}: {
  type: string;
  name: string;
  text?: string;
  bytes?: number[];
}): void {
  const dataTransfer = new DataTransfer();
  dataTransfer.items.add(new File([text ?? new Uint8Array(bytes ?? [])], name));
  const event = new DragEvent(type, { dataTransfer, bubbles: true, cancelable: true });
  document.querySelector("#stage")?.dispatchEvent(event);
  if (!event.defaultPrevented) throw new Error(`The page did not handle ${type}: the browser would open the file`);
}
