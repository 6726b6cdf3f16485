/** The page, the element and the examples, by what a user sees and does: the same cases in each browser. */
import { mkdtempSync, readdirSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { expect, onTestFinished, test } from "vitest";
import { compressByMeshopt, withTexture } from "../avatar/compressed-files";
import { createFigureFile } from "../avatar/figure-files";
import { ETC1S_TEXTURE } from "../avatar/textures";
import { createBowingBvh } from "../browser/bvh-file";
import { type BrowserWindow, type PointerType, WAIT_TIMEOUT_MS } from "./browser";
import { connectGamepad, moveStick } from "./gamepad";
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
  SHIFT,
  tapKey,
  waitFor,
  waitForAnnouncement,
  waitForButton,
  waitForHand,
  waitForStart,
} from "./page";
import type { WebDriverFixture } from "./webdriver-suite";

/** Smallest share of pixels in the middle of the window that a puppet changes. */
const MIN_PUPPET_SHARE = 0.05;
/** Share of these pixels that the movement of a hand changes. A screenshot without the stage changes more. */
const isMovement = (share: number) => share > 0.005 && share < 0.5;
/** Smallest amplitude of a sound that can be heard. */
const MIN_SOUND_LEVEL = 0.01;
/** Interval of polling in this process, which takes processor time from the browser. */
const POLL_INTERVAL_MS = 200;

/** Place on the stage beside the puppet. */
const BACKGROUND: Point = { x: 60, y: 200 };

const LIMB_KEYS = ["1", "2", "3", "4"];
const PNG_SIGNATURE = "\x89PNG\r\n\x1a\n";

export function definePageCases(fixture: WebDriverFixture): void {
  const { browser, open } = fixture;

  /** Wait until the server reports the number of limbs that are held. */
  async function waitForHeldLimbs(count: number): Promise<void> {
    await poll("number of limbs that are held, on the server", async () => {
      const { limbs } = await fixture.state();
      return limbs.filter((holder) => holder !== null).length;
    }).toBe(count);
  }

  /** Drag a hand upwards and release it: it moves, and does not stay there. */
  async function pullHand(window: BrowserWindow, pointerType: PointerType, hand: Point): Promise<void> {
    await waitForHand(window, hand);
    const before = await window.screenshot();
    await point(window, pointerType, ["move", hand], ["down"]);
    await waitForHeldLimbs(1);
    await point(window, pointerType, ["move", { x: hand.x - 40, y: hand.y - 60 }]);
    await expectChange(window, before).toSatisfy(isMovement);
    const pulled = await window.screenshot();
    await point(window, pointerType, ["up"]);
    await waitForHeldLimbs(0);
    // Not compared with the first screenshot: where frames take long, the page has reduced its quality since.
    await expectChange(window, pulled).toSatisfy(isMovement);
  }

  /** Wait until a file whose name ends with `ending` was downloaded, and return its content in Latin-1. */
  async function waitForDownload(ending: string): Promise<string> {
    let content = "";
    await poll(`size of a downloaded file *${ending}`, () => {
      const name = readdirSync(fixture.downloads()).find((name) => name.endsWith(ending));
      const previous = content;
      content = name === undefined ? "" : readFileSync(join(fixture.downloads(), name), "latin1");
      return content !== "" && content === previous;
    }).toBe(true);
    return content;
  }

  /** Click on the background, after which browsers allow sound, and wait until it is heard. */
  async function hearSound(window: BrowserWindow): Promise<void> {
    await point(window, "mouse", ["move", BACKGROUND], ["down"], ["up"]);
    await waitFor(window, "the sound switched on", () => document.querySelector('[title="Sound off"]') !== null);
    await fixture.play();
    await waitFor(
      window,
      "that sound is played",
      (level) => globalThis.window.probe.getSoundLevel() > level,
      MIN_SOUND_LEVEL,
    );
  }

  test("the puppet is drawn, and pulled by mouse, touch, keys and gamepad", async () => {
    const window = await openAndSeePuppet(fixture, "name=Aiko");

    // The invitation to take a hand, which covers the stage, ends with the first claim.
    const hand = await findHand(window);
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

    for (const pointerType of ["mouse", "touch"] as const) await pullHand(window, pointerType, hand);

    await evaluate(window, connectGamepad);
    await evaluate(window, moveStick, -0.9);
    await waitForHeldLimbs(1);
    await evaluate(window, moveStick, 0);
    await waitForHeldLimbs(0);
  });

  test("sound is heard, and a shared link opens in a second window", async () => {
    const window = await open("?name=Aiko");
    await waitForStart(window);
    await hearSound(window);
    await clickButton(window, "Sound");
    await waitFor(window, "the sound switched off", () => document.querySelector('[title="Sound on"]') !== null);

    await clickButton(window, "Share link");
    await waitForAnnouncement(window, "Link copied");
    const link = await paste(window);
    expect(new URL(link).searchParams.get("session")).toBe(fixture.session);
    const second = await open(link);
    await waitForStart(second);
    await pressKey(second, "2");
    await waitForHeldLimbs(1);
  });

  test("files are uploaded by choice and by drop; a motion and a picture are downloaded", async () => {
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
    const bvh = Buffer.from(createBowingBvh(131 + browser.length)).toString("base64");
    await evaluate(window, dropFile, `${dropped}.bvh`, bvh);
    await waitForMotion(window, dropped);
    expect(await evaluate(window, () => document.querySelectorAll(".problem").length)).toBe(0);

    await clickButton(window, "Save a picture");
    expect((await waitForDownload(".png")).slice(0, PNG_SIGNATURE.length)).toBe(PNG_SIGNATURE);
    // In a narrow window a motion that goes on the stage closes the library.
    await clickButton(window, "Library");
    await pressButton(window, `Download ${dropped}`);
    await pressButton(window, "BVH, motion for animation programs");
    expect((await waitForDownload(`${dropped}.bvh`)).slice(0, 9)).toBe("HIERARCHY");
  });

  test("an avatar that a private window stores is there after a reload", async () => {
    await fixture.useSession({ isPrivate: true });
    const window = await open();
    await waitForStart(window);
    await evaluate(window, dropFile, "boxes.vrm", AVATAR_BASE64);
    await waitForAnnouncement(window, "dances here");
    const isStored = await evaluate(window, () =>
      globalThis.window.probe.announcements.some((text) => text.includes("everyone else sees the puppet")),
    );
    await window.goto(`${fixture.url}/?session=${fixture.session}`);
    await waitForStart(window);
    await clickButton(window, "Library");
    await waitForButton(window, isStored ? "Choose another avatar" : "Choose your own avatar");
  });

  test("a compressed texture of an avatar is decoded", async () => {
    // Firefox with a WebDriver BiDi session sometimes never returns from `new Worker` in a worker [2 of 15 pages that
    // did nothing else; none of 1,600 without the session]. So the page starts the decoder's.
    const window = await open("?engine=page");
    await waitForStart(window);
    await evaluate(window, dropFile, "textured.vrm", TEXTURED_AVATAR_BASE64);
    await waitForAnnouncement(window, "dances here");
  });

  test("without storage the page works, and says that it cannot store an avatar", async () => {
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
    await evaluate(window, dropFile, "boxes.vrm", AVATAR_BASE64);
    expect(await waitForAnnouncement(window, "for this visit only: this browser cannot store it")).toBe(1);
  });

  test("an embedded stage is drawn and its buttons take limbs", async () => {
    const window = await open(await fixture.publish(embedStage(fixture)));
    const empty = await window.screenshot();
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

  test("without WebGL 2 page and element say so once, and the page works", async () => {
    fixture.removeFeatures(() => {
      const { HTMLCanvasElement, OffscreenCanvas } = globalThis as Partial<typeof globalThis>;
      for (const canvas of [HTMLCanvasElement, OffscreenCanvas]) {
        if (!canvas) continue;
        const getContext = canvas.prototype.getContext as (type: string, ...options: unknown[]) => unknown;
        Object.assign(canvas.prototype, {
          getContext(type: string, ...options: unknown[]) {
            return type === "webgl2" ? null : getContext.call(this, type, ...options);
          },
        });
      }
    });
    const window = await open();
    expect(await waitForAnnouncement(window, "This browser cannot draw the stage")).toBe(1);
    await clickButton(window, "Library");
    await waitFor(window, "the motions of the library", () => document.body.innerText.includes("with music"));
    await window.goto(await fixture.publish(embedStage(fixture)));
    expect(await waitForAnnouncement(window, "This browser cannot draw the stage")).toBe(1);
  });

  test("without audio, clipboard and gamepads the page says so, each once", async () => {
    fixture.removeFeatures(() => {
      Object.assign(globalThis, { AudioContext: undefined });
      const { Navigator } = globalThis as Partial<typeof globalThis>;
      if (Navigator)
        for (const name of ["clipboard", "getGamepads"] as const)
          delete (Navigator.prototype as Partial<Navigator>)[name];
    });
    const window = await open();
    await waitForStart(window);
    await waitForAnnouncement(window, "This browser plays no sound here");
    await clickButton(window, "Sound");
    await clickButton(window, "Share link");
    await waitForAnnouncement(window, `Copy this link: ${fixture.url}/?session=${fixture.session}`);
    expect(await waitForAnnouncement(window, "This browser plays no sound here")).toBe(1);
    await tapKey(window, "?", SHIFT);
    await waitFor(window, "that gamepads need HTTPS", () =>
      document.querySelector(".pad-state")?.textContent?.includes("only on pages with HTTPS"),
    );
  });

  test("without WebCodecs and OffscreenCanvas the puppet is drawn and the sound is heard", async () => {
    fixture.removeFeatures(() => {
      Object.assign(globalThis, { AudioDecoder: undefined, OffscreenCanvas: undefined });
      const { HTMLCanvasElement } = globalThis as Partial<typeof globalThis>;
      if (HTMLCanvasElement)
        delete (HTMLCanvasElement.prototype as Partial<HTMLCanvasElement>).transferControlToOffscreen;
    });
    const window = await open();
    await waitForStart(window);
    await hearSound(window);
    await pressKey(window, "2");
    await waitForHeldLimbs(1);
    expect(await evaluate(window, () => globalThis.window.probe.announcements)).toEqual([]);
  });
}

/**
 * Cases that take seconds per frame without a graphics processor, and minutes on a busy machine. They are the project
 * `webdriver-slow`, which only `make test-webdriver` runs.
 */
export function defineSlowCases(fixture: WebDriverFixture): void {
  test("the puppet is drawn in the quality for graphics processors", async () => {
    await openAndSeePuppet(fixture, "quality=best");
  });
}

const FIGURE_FILE = createFigureFile({ vrm: 1, dressed: true });

/** A small avatar file, whose mesh every browser has to decode. */
const AVATAR_BASE64 = Buffer.from(await compressByMeshopt(FIGURE_FILE)).toString("base64");

/** An avatar file whose texture is decoded in a worker of its own. */
const TEXTURED_AVATAR_BASE64 = Buffer.from(withTexture(FIGURE_FILE, ETC1S_TEXTURE)).toString("base64");

function poll<T>(message: string, read: () => T | Promise<T>) {
  return expect.poll(read, { timeout: WAIT_TIMEOUT_MS, interval: POLL_INTERVAL_MS, message });
}

/** Poll the share of the stage that differs from a screenshot. */
function expectChange(window: BrowserWindow, before: string) {
  return poll("share of pixels that differ from an earlier screenshot", async () =>
    compareScreenshots(window, before, await window.screenshot()),
  );
}

/** Open the page of the test's session with more parameters, and wait until it shows more than an empty stage. */
async function openAndSeePuppet({ open, url, session }: WebDriverFixture, parameters: string): Promise<BrowserWindow> {
  const window = await open("?session=no-such-session");
  await waitForAnnouncement(window, "The session has ended");
  const empty = await window.screenshot();
  await window.goto(`${url}/?session=${session}&${parameters}`);
  await waitForStart(window);
  await expectChange(window, empty).toBeGreaterThan(MIN_PUPPET_SHARE);
  return window;
}

/** Return a page of another site with a stage. */
function embedStage({ url, session }: WebDriverFixture): string {
  return `<!doctype html><title>Another site</title>
    <script type="module" src="${url}/embed/bunraku-stage.js"></script>
    <bunraku-stage src="${url}/?session=${session}" controls style="width: 400px; height: 300px"></bunraku-stage>`;
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

/** In the page: drop a file on the stage. A driver cannot drag files into a window. */
function dropFile(name: string, base64: string): void {
  const bytes = Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0));
  const dataTransfer = new DataTransfer();
  dataTransfer.items.add(new File([bytes], name));
  for (const type of ["dragover", "drop"]) {
    const event = new DragEvent(type, { dataTransfer, bubbles: true, cancelable: true });
    document.querySelector("#stage")?.dispatchEvent(event);
    if (!event.defaultPrevented) throw new Error(`The page did not handle ${type}: the browser would open the file`);
  }
}
