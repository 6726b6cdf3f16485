/** A file dropped on the page in a real browser. */
import type { Browser, Page } from "playwright-core";
import { afterAll, beforeAll, describe, expect, test } from "vitest";
import { launch } from "./chromium";
import { chromium, startServer, type RunningServer } from "./server";

const PATIENCE = 90_000;

const path = chromium();
if (!path && process.env["CI"]) throw new Error("the browser tests must run in CI: install Chromium");
if (!path) console.warn("browser test of dropping skipped: Chromium is not installed");

describe.skipIf(!path)("a drop on the page", { timeout: 2 * PATIENCE }, () => {
  let server: RunningServer;
  let browser: Browser;
  let page: Page;

  beforeAll(async () => {
    [server, browser] = await Promise.all([startServer({ demo: false }), launch(path ?? "")]);
    // Small, as the picture is drawn in software.
    page = await browser.newPage({ viewport: { width: 500, height: 400 }, reducedMotion: "reduce" });
    page.setDefaultTimeout(PATIENCE);
    page.on("pageerror", (error) => {
      throw error;
    });
    await page.goto(server.url);
    await page.getByRole("complementary", { name: "Library" }).waitFor();
  }, PATIENCE);
  afterAll(async () => {
    await browser?.close();
    await server?.stop();
  }, PATIENCE);

  test("a file dropped anywhere on the page is uploaded and danced", async () => {
    await page.evaluate(drag, { type: "dragover", name: "dropped.bvh", text: DANCE });
    await page.locator(".drop-frame").waitFor();
    await page.evaluate(drag, { type: "drop", name: "dropped.bvh", text: DANCE });
    await page.locator(".drop-frame").waitFor({ state: "hidden" });
    await page.locator(".brand-piece", { hasText: "dropped" }).waitFor({ state: "attached" });
    expect(await page.locator(".problem").count()).toBe(0);
    const stored = await page.evaluate(async () => (await (await fetch("/v1/motions")).json()) as { items: { filename: string }[] });
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

/** Two seconds of a figure that bows, centimetres and degrees. */
const DANCE = bowing();

function bowing(): string {
  const rotations = "CHANNELS 3 Zrotation Xrotation Yrotation";
  const bone = (name: string, offset: string, inside: string): string => `JOINT ${name}\n{\nOFFSET ${offset}\n${rotations}\n${inside}}\n`;
  const end = (offset: string) => `End Site\n{\nOFFSET ${offset}\n}\n`;
  const side = (name: string, x: number) => ({
    leg: bone(`${name}UpLeg`, `${10 * x} -5 0`, bone(`${name}Leg`, "0 -42 0", bone(`${name}Foot`, "0 -42 0", end("0 -6 12")))),
    arm: bone(`${name}Arm`, `${18 * x} 12 0`, bone(`${name}ForeArm`, `${28 * x} 0 0`, bone(`${name}Hand`, `${26 * x} 0 0`, end(`${16 * x} 0 0`)))),
  });
  const [left, right] = [side("Left", 1), side("Right", -1)];
  const spine = bone("Spine", "0 12 0", bone("Spine1", "0 20 0", bone("Neck", "0 20 0", bone("Head", "0 10 0", end("0 18 0"))) + left.arm + right.arm));
  const joints = 1 + 6 + 4 + 6;
  const root = `ROOT Hips\n{\nOFFSET 0 0 0\nCHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation\n${left.leg}${right.leg}${spine}}\n`;
  const frames = Array.from({ length: 60 }, (_, i) => {
    const values = new Array<number>(3 + 3 * joints).fill(0);
    values[1] = 95;
    values[3 + 3 * 7 + 1] = 20 * Math.sin((Math.PI * i) / 30);
    return values.map((value) => value.toFixed(3)).join(" ");
  });
  return `HIERARCHY\n${root}MOTION\nFrames: ${frames.length}\nFrame Time: 0.033333\n${frames.join("\n")}\n`;
}
