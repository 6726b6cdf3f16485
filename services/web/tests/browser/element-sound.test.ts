/** The sound of a stage in another site's page: silent until it is asked for, and then heard in what the page puts out. */
import type { Page } from "playwright-core";
import { afterAll, beforeAll, expect, test } from "vitest";
import { describeInBrowser, type OpenOptions } from "./browser-suite";
import { countLoadedScripts, createEmbeddingPage, waitForStages } from "./embedding-page";
import { startForeignSite } from "./foreign-site";
import { tapKey } from "./page-probe";
import { makeToken } from "./server";

declare global {
  interface Window {
    /** What the page puts out: each that was connected to a device, and what it is heard by. */
    outputs: { output: GainNode; ear: AnalyserNode }[];
    /** How it stood each time the stage told of a change: muted, volume. */
    changes: [boolean, number][];
  }
}

const SECRET = "the secret of a server whose stages are heard in other pages";
/** Of a sample, 0 to 1: more than silence. */
const SOUND = 0.005;
/** Scripts that play and decode. */
const CODE = /^(sound|webcodecs|wasm)\b.*\.js$/;

const site = await startForeignSite();
afterAll(() => site.stop());

describeInBrowser(
  "the sound of a stage in another site's page",
  { demo: true, secret: SECRET, origins: site.origin },
  (own) => {
    let token: string;

    beforeAll(() => void (token = makeToken(SECRET, "control")));

    async function open(attributes: string, opening: OpenOptions = {}): Promise<Page> {
      site.html = createEmbeddingPage(
        `<bunraku-stage src="${own.url}/#token=${token}" style="width: 300px" ${attributes}></bunraku-stage><button>Listen</button>`,
        own.url,
      );
      const page = await own.open(site.origin, { ...opening, before: (page) => page.addInitScript(eavesdrop) });
      await waitForStages(page);
      await page.waitForFunction(() => document.querySelector("bunraku-stage")?.viewer?.audio);
      return page;
    }

    test("is asked for by its button, with keys and by touch", async () => {
      const page = await open('controls muted volume="0.5"', { hasTouch: true });
      const button = page.getByRole("button", { name: "Sound" });
      await button.waitFor();
      // whatever else is pressed
      await page.getByRole("button", { name: "Listen" }).click();
      await page.getByRole("button", { name: "Take the left hand" }).click();
      await page.getByRole("button", { name: "Release the left hand" }).click();
      expect(await stand(page)).toEqual({ muted: true, volume: 0.5, pressed: "false", devices: 0, changes: [] });
      expect(await countLoadedScripts(page, CODE)).toBe(0);

      await button.press("Enter");
      await heard(page, true);
      expect(await stand(page)).toEqual({
        muted: false,
        volume: 0.5,
        pressed: "true",
        devices: 1,
        changes: [[false, 0.5]],
      });
      expect(await countLoadedScripts(page, CODE)).toBe(2);
      await page.waitForFunction(() => Math.abs(window.outputs[0].output.gain.value - 0.5 ** 2) < 1e-3);
      await button.tap();
      await heard(page, false);
      expect(await stand(page)).toEqual({
        muted: true,
        volume: 0.5,
        pressed: "false",
        devices: 1,
        changes: [
          [false, 0.5],
          [true, 0.5],
        ],
      });
      await button.tap();
      await heard(page, true);
      // by key, which is the stage's while it has the focus
      await tapKey(page, "KeyM");
      await heard(page, false);
      await tapKey(page, "KeyM");
      await heard(page, true);

      // what came on is another motion's, on the same device; taken away it gives that back
      await page.evaluate(() => {
        const stage = document.querySelector("bunraku-stage")!;
        stage.src = stage.src.replace("/#", `/v1/motions/${stage.viewer!.motion}#`);
      });
      await page.waitForFunction(() => document.querySelector("bunraku-stage")?.viewer?.audio);
      await heard(page, true);
      expect((await stand(page)).devices).toBe(1);
      await page.evaluate(() => document.querySelector("bunraku-stage")!.remove());
      await page.waitForFunction(() => window.outputs[0].output.context.state === "closed");
    });

    test("is asked for by the page about it, where the stage has no button", async () => {
      const page = await open("");
      expect(await page.evaluate(() => document.querySelector("bunraku-stage")!.muted)).toBe(true);
      await page.evaluate(() => {
        const stage = document.querySelector("bunraku-stage")!;
        document.querySelector("button")!.addEventListener("click", () => (stage.muted = !stage.muted));
      });
      const button = page.getByRole("button", { name: "Listen" });
      expect(await page.getByRole("button").count()).toBe(1);
      await button.click();
      await heard(page, true);
      await page.evaluate(() => (document.querySelector("bunraku-stage")!.volume = 0.25));
      await page.waitForFunction(() => Math.abs(window.outputs[0].output.gain.value - 0.25 ** 2) < 1e-3);
      expect(await page.locator("bunraku-stage").getAttribute("volume")).toBe("0.25");
      await page.evaluate(() => document.querySelector("bunraku-stage")!.setAttribute("volume", "loud"));
      expect(await page.evaluate(() => document.querySelector("bunraku-stage")!.volume)).toBe(1);
      expect(
        await page.evaluate(() => {
          try {
            document.querySelector("bunraku-stage")!.volume = 2;
            return null;
          } catch (error) {
            return (error as Error).name;
          }
        }),
      ).toBe("IndexSizeError");
      // as an attribute
      await page.evaluate(() => document.querySelector("bunraku-stage")!.setAttribute("muted", ""));
      await heard(page, false);
      await page.evaluate(() => document.querySelector("bunraku-stage")!.removeAttribute("muted"));
      await heard(page, true);
      expect(await page.evaluate(() => window.changes)).toEqual([
        [false, 1],
        [false, 0.25],
        [false, 1],
        [true, 1],
        [false, 1],
      ]);

      // in another language it is heard as it was
      await page.evaluate(() => document.querySelector("bunraku-stage")!.setAttribute("lang", "ja"));
      await page.waitForFunction(
        () => window.outputs.length === 2 && window.outputs[0].output.context.state === "closed",
      );
      await page.evaluate(() => window.outputs.shift());
      await heard(page, true);
    });
  },
);

/** In the page, before it: listens to whatever is put out, and notes what the stage tells of it. */
function eavesdrop(): void {
  Object.assign(window, { outputs: [], changes: [] });
  const connect = AudioNode.prototype.connect as (this: AudioNode, to: AudioNode) => AudioNode;
  AudioNode.prototype.connect = function (this: AudioNode, to: AudioNode) {
    if (to instanceof AudioDestinationNode) {
      const ear = new AnalyserNode(this.context);
      connect.call(this, ear);
      window.outputs.push({ output: this as GainNode, ear });
    }
    return connect.call(this, to);
  } as typeof AudioNode.prototype.connect;
  document.addEventListener(
    "volumechange",
    ({ target }) => {
      const { muted, volume } = target as HTMLElementTagNameMap["bunraku-stage"];
      window.changes.push([muted, volume]);
    },
    { capture: true },
  );
}

/** Waits until something is heard, or until the only device stands. */
async function heard(page: Page, on: boolean): Promise<void> {
  await page.waitForFunction(
    ({ on, SOUND }) => {
      const [{ output, ear }] = window.outputs.length === 1 ? window.outputs : [{ output: null, ear: null }];
      if (!output) return false;
      if (!on) return output.context.state === "suspended";
      const samples = new Float32Array(ear.fftSize);
      ear.getFloatTimeDomainData(samples);
      return output.context.state === "running" && samples.some((sample) => Math.abs(sample) > SOUND);
    },
    { on, SOUND },
  );
}

/** How the stage's sound stands, and what was told of it. */
async function stand(page: Page) {
  const pressed = await page.getByRole("button", { name: "Sound" }).getAttribute("aria-pressed");
  return page.evaluate((pressed) => {
    const { muted, volume } = document.querySelector("bunraku-stage")!;
    return { muted, volume, pressed, devices: window.outputs.length, changes: window.changes };
  }, pressed);
}
