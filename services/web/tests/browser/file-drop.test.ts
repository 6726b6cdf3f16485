/** A file dropped on the page in a real browser. */
import { expect, test } from "vitest";
import { describeInBrowser } from "./browser-suite";
import { createBowingBvh } from "./bvh-file";

/** Two seconds. */
const DANCE = createBowingBvh(60);

describeInBrowser("a drop on the page", {}, ({ open }) => {
  test("a file dropped anywhere on the page is uploaded and danced", async () => {
    const page = await open("", { viewport: { width: 500, height: 400 }, reducedMotion: "reduce" });
    await page.getByRole("complementary", { name: "Library" }).waitFor();
    await page.evaluate(drag, { type: "dragover", name: "dropped.bvh", text: DANCE });
    await page.locator(".drop-frame").waitFor();
    await page.evaluate(drag, { type: "drop", name: "dropped.bvh", text: DANCE });
    await page.locator(".drop-frame").waitFor({ state: "hidden" });
    await page.locator(".brand-piece", { hasText: "dropped" }).waitFor({ state: "attached" });
    expect(await page.locator(".problem").count()).toBe(0);
    const stored = await page.evaluate(
      async () => (await (await fetch("/v1/motions")).json()) as { items: { filename: string }[] },
    );
    expect(stored.items.map(({ filename }) => filename)).toContain("dropped.bvh");
  });
});

/** In the page: a file over the stage or dropped on it, as the browser tells of it. */
function drag({ type, name, text }: { type: string; name: string; text: string }): void {
  const dataTransfer = new DataTransfer();
  dataTransfer.items.add(new File([text], name));
  const event = new DragEvent(type, { dataTransfer, bubbles: true, cancelable: true });
  document.querySelector("#stage")?.dispatchEvent(event);
  if (!event.defaultPrevented) throw new Error(`the browser would have opened the file: ${type} was not taken`);
}
