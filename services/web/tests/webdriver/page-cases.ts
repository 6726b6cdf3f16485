/** The page, the element and the examples, by what a user sees and does: the same cases in each browser. */
import { existsSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { expect, onTestFinished, test } from "vitest";
import { createBowingBvh } from "../browser/bvh-file";
import { type BrowserWindow, type PointerType, WAIT_TIMEOUT_MS } from "./browser";
import {
  CONTROL,
  clickButton,
  compareScreenshots,
  ESCAPE,
  evaluate,
  findHand,
  type Point,
  point,
  pressButton,
  pressKey,
  releaseKey,
  tapKey,
  waitFor,
  waitForButton,
  waitForStart,
} from "./page";
import { type BrowserName, describeInWebDriver } from "./webdriver-suite";

/** Smallest share of pixels in the middle of the window that a puppet changes, and that the movement of a hand does. */
const [MIN_PUPPET_SHARE, MIN_MOVEMENT_SHARE] = [0.05, 0.005];

const LIMB_KEYS = ["1", "2", "3", "4"];

export function definePageCases(browser: BrowserName): void {
  describeInWebDriver(browser, (fixture) => {
    const { open } = fixture;

    /** Wait until the server reports the number of limbs that are held. */
    async function waitForHeldLimbs(count: number): Promise<void> {
      await expect
        .poll(async () => (await fixture.state()).limbs.filter((holder) => holder !== null).length, {
          timeout: WAIT_TIMEOUT_MS,
          message: "number of limbs that are held, on the server",
        })
        .toBe(count);
    }

    /** Poll the share of the stage that differs from a screenshot. */
    function expectChange(window: BrowserWindow, before: string) {
      return expect.poll(async () => compareScreenshots(window, before, await window.screenshot()), {
        timeout: WAIT_TIMEOUT_MS,
        message: "share of pixels that differ from an earlier screenshot",
      });
    }

    /** Drag a hand upwards and release it: it moves, and returns. */
    async function pullHand(window: BrowserWindow, pointerType: PointerType, hand: Point): Promise<void> {
      const before = await window.screenshot();
      await point(window, pointerType, ["move", hand], ["down"]);
      await waitForHeldLimbs(1);
      await point(window, pointerType, ["move", { x: hand.x - 40, y: hand.y - 60 }]);
      await expectChange(window, before).toBeGreaterThan(MIN_MOVEMENT_SHARE);
      await point(window, pointerType, ["up"]);
      await waitForHeldLimbs(0);
      await expectChange(window, before).toBeLessThan(MIN_MOVEMENT_SHARE / 2);
    }

    test("the puppet is drawn, and pulled by mouse, touch and keys", async () => {
      const window = await open("?session=no-such-session");
      await waitFor(window, "the notice of an ended session", () =>
        document.body.innerText.includes("The session has ended"),
      );
      const empty = await window.screenshot();
      await window.goto(`${fixture.url}/?session=${fixture.session}&name=Aiko`);
      await waitForStart(window);
      await expectChange(window, empty).toBeGreaterThan(MIN_PUPPET_SHARE);

      const held = [];
      for (const key of LIMB_KEYS) {
        // A long press holds the limb while it lasts, a short one until the next.
        await pressKey(window, key);
        await waitForHeldLimbs(1);
        const { limbs, puppeteers } = await fixture.state();
        held.push(limbs.findIndex((holder) => holder !== null));
        expect(puppeteers.map(({ name }) => name)).toEqual(["Aiko"]);
        await releaseKey(window, key);
        await tapKey(window, ESCAPE);
        await waitForHeldLimbs(0);
      }
      expect(held.sort()).toEqual([0, 1, 2, 3]);

      // The invitation to take a hand, which covers the stage, ended with the first claim.
      const hand = await findHand(window);
      for (const pointerType of ["mouse", "touch"] as const) await pullHand(window, pointerType, hand);
    });

    test("sound is switched on, and a shared link opens in a second window", async () => {
      const window = await open("?name=Aiko");
      await waitForStart(window);
      await clickButton(window, "Sound");
      await waitFor(window, "the sound switched on", () => document.querySelector('[title="Sound off"]') !== null);
      await clickButton(window, "Sound");
      await waitFor(window, "the sound switched off", () => document.querySelector('[title="Sound on"]') !== null);

      await clickButton(window, "Share link");
      await waitFor(window, "the note of a copied link", () => document.body.innerText.includes("Link copied"));
      const link = await paste(window);
      expect(new URL(link).searchParams.get("session")).toBe(fixture.session);
      const second = await open(link);
      await waitForStart(second);
      await pressKey(second, "2");
      await waitForHeldLimbs(1);
    });

    test("files are uploaded by choice and by drop, and a motion is downloaded", async () => {
      const folder = mkdtempSync(join(tmpdir(), "bunraku-upload-"));
      onTestFinished(() => rmSync(folder, { recursive: true }));
      const name = `chosen in ${browser}`;
      writeFileSync(join(folder, `${name}.bvh`), createBowingBvh(31 + browser.length));
      const window = await open();
      await waitForStart(window);
      await clickButton(window, "Library");
      await window.chooseFile('input[type=file][accept*=".bvh"]', join(folder, `${name}.bvh`));
      await waitForMotion(window, name);

      const dropped = `dropped in ${browser}`;
      await evaluate(window, dropFile, `${dropped}.bvh`, createBowingBvh(131 + browser.length));
      await waitForMotion(window, dropped);
      expect(await evaluate(window, () => document.querySelectorAll(".problem").length)).toBe(0);

      await pressButton(window, `Download ${dropped}`);
      await pressButton(window, "BVH, motion for animation programs");
      const path = join(fixture.downloads(), `${dropped}.bvh`);
      await expect
        .poll(() => existsSync(path) && readFileSync(path, "utf8").slice(0, 9), {
          timeout: WAIT_TIMEOUT_MS,
          message: `start of ${path}`,
        })
        .toBe("HIERARCHY");
    });

    test("without storage the page works", async () => {
      await fixture.useSession({ hasStorage: false });
      const window = await open();
      await waitForStart(window);
      expect(
        await evaluate(window, () => {
          try {
            localStorage.setItem("test", "test");
            return "storage works";
          } catch {
            return "storage throws";
          }
        }),
      ).toBe("storage throws");
      await pressKey(window, "2");
      await waitForHeldLimbs(1);
    });

    test("an embedded stage is drawn and its buttons take limbs", async () => {
      const address = `${fixture.url}/?session=${fixture.session}`;
      const window = await open(
        await fixture.publish(
          `<!doctype html><title>Another site</title>
          <script type="module" src="${fixture.url}/embed/bunraku-stage.js"></script>
          <bunraku-stage src="${address}" controls style="width: 600px; height: 400px"></bunraku-stage>`,
        ),
      );
      const empty = await window.screenshot();
      // A page that compiles its shaders is blocked for so long that it loses its limbs.
      await expectChange(window, empty).toBeGreaterThan(MIN_PUPPET_SHARE);
      await clickButton(window, "Take the left hand");
      await waitForHeldLimbs(1);
      await clickButton(window, "Release the left hand, held by you");
      await waitForHeldLimbs(0);
    });

    test("the examples are shown beside their sources", async () => {
      const window = await open("/examples/");
      await waitFor(window, "the sources of all examples", () =>
        [...document.querySelectorAll("pre")].every(({ innerText }) => innerText.includes("/embed/bunraku")),
      );
      await waitForButton(window, "Take the left hand");
      expect(
        await evaluate(window, () =>
          [...document.querySelectorAll("bunraku-stage")].flatMap(
            ({ shadowRoot }) => shadowRoot?.querySelector<HTMLElement>(".notice:not([hidden])")?.innerText ?? [],
          ),
        ),
      ).toEqual([]);
    });
  });
}

/** Wait until a motion is on the stage. */
async function waitForMotion(window: BrowserWindow, name: string): Promise<void> {
  await waitFor(
    window,
    `the motion "${name}"`,
    (name) => document.querySelector(".brand-piece")?.textContent === name,
    name,
  );
}

/** Paste the text of the clipboard into a field, and return it. */
async function paste(window: BrowserWindow): Promise<string> {
  await evaluate(window, () => {
    const field = document.createElement("textarea");
    document.body.append(field);
    field.focus();
  });
  await tapKey(window, "v", CONTROL);
  return waitFor(window, "the pasted text", () => document.querySelector("textarea")?.value);
}

/** In the page: drop a file on the stage. */
function dropFile(name: string, text: string): void {
  const dataTransfer = new DataTransfer();
  dataTransfer.items.add(new File([text], name));
  for (const type of ["dragover", "drop"]) {
    const event = new DragEvent(type, { dataTransfer, bubbles: true, cancelable: true });
    document.querySelector("#stage")?.dispatchEvent(event);
    if (!event.defaultPrevented) throw new Error(`The page did not handle ${type}: the browser would open the file`);
  }
}
