/** Sound of an embedded stage: muted until the viewer or the page turns it on. */
import type { Page } from "playwright-core";
import { expect, test } from "vitest";
import { describeInBrowser, type OpenOptions } from "./browser-suite";
import { countLoadedScripts, createEmbeddingPage, waitForStages } from "./embedding-page";
import { tapKey } from "./page-probe";

declare global {
  interface Window {
    /** Nodes that the page connected to an audio device, each with an analyser that receives the same signal. */
    outputs: { output: GainNode; analyser: AnalyserNode }[];
    /** State at each `volumechange` event of the stage: muted, volume. */
    changes: [boolean, number][];
  }
}

/** Samples above this magnitude (0 to 1) are not silence. */
const SILENCE_THRESHOLD = 0.005;
/** Scripts that decode and play audio. */
const AUDIO_SCRIPTS = /^(sound|webcodecs|wasm)\b.*\.js$/;

describeInBrowser("sound of an embedded stage", { server: "guarded" }, (fixture) => {
  async function open(attributes: string, options: OpenOptions = {}): Promise<Page> {
    const address = `${fixture.url}/?session=${fixture.session}#token=${fixture.tokens?.control}`;
    const stage = `<bunraku-stage src="${address}" style="width: 300px" ${attributes}></bunraku-stage>`;
    const path = await fixture.publish(createEmbeddingPage(`${stage}<button>Listen</button>`, fixture.url));
    const page = await fixture.open(fixture.site.origin + path, {
      ...options,
      before: (page) => page.addInitScript(recordOutputs),
    });
    await waitForStages(page);
    await page.waitForFunction(() => document.querySelector("bunraku-stage")?.viewer?.audio);
    return page;
  }

  test("the sound button works by keyboard, touch and shortcut", async () => {
    const page = await open('controls muted volume="0.5"', { hasTouch: true });
    const button = page.getByRole("button", { name: "Sound" });
    await button.waitFor();
    // Other controls do not start the sound.
    await page.getByRole("button", { name: "Listen" }).click();
    await page.getByRole("button", { name: "Take the left hand" }).click();
    await page.getByRole("button", { name: "Release the left hand" }).click();
    expect(await soundState(page)).toEqual({ muted: true, volume: 0.5, pressed: "false", devices: 0, changes: [] });
    expect(await countLoadedScripts(page, AUDIO_SCRIPTS)).toBe(0);

    await button.press("Enter");
    await waitForSound(page, true);
    expect(await soundState(page)).toEqual({
      muted: false,
      volume: 0.5,
      pressed: "true",
      devices: 1,
      changes: [[false, 0.5]],
    });
    expect(await countLoadedScripts(page, AUDIO_SCRIPTS)).toBe(2);
    await page.waitForFunction(() => Math.abs(window.outputs[0].output.gain.value - 0.5 ** 2) < 1e-3);
    await button.tap();
    await waitForSound(page, false);
    expect(await soundState(page)).toEqual({
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
    await waitForSound(page, true);
    // The stage receives keys while it has the focus.
    await tapKey(page, "KeyM");
    await waitForSound(page, false);
    await tapKey(page, "KeyM");
    await waitForSound(page, true);

    // Another motion uses the same audio context, which closes when the element is removed.
    await page.evaluate(() => {
      const stage = document.querySelector("bunraku-stage")!;
      stage.src = stage.src.replace(/\/\?.*#/, `/v1/motions/${stage.viewer!.motion}#`);
    });
    await page.waitForFunction(() => document.querySelector("bunraku-stage")?.viewer?.audio);
    await waitForSound(page, true);
    expect((await soundState(page)).devices).toBe(1);
    await page.evaluate(() => document.querySelector("bunraku-stage")!.remove());
    await page.waitForFunction(() => window.outputs[0].output.context.state === "closed");
  });

  test("the embedding page controls the sound of a stage without controls", async () => {
    const page = await open("");
    expect(await page.evaluate(() => document.querySelector("bunraku-stage")!.muted)).toBe(true);
    await page.evaluate(() => {
      const stage = document.querySelector("bunraku-stage")!;
      document.querySelector("button")!.addEventListener("click", () => (stage.muted = !stage.muted));
    });
    const button = page.getByRole("button", { name: "Listen" });
    expect(await page.getByRole("button").count()).toBe(1);
    await button.click();
    await waitForSound(page, true);
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
    // By attribute.
    await page.evaluate(() => document.querySelector("bunraku-stage")!.setAttribute("muted", ""));
    await waitForSound(page, false);
    await page.evaluate(() => document.querySelector("bunraku-stage")!.removeAttribute("muted"));
    await waitForSound(page, true);
    expect(await page.evaluate(() => window.changes)).toEqual([
      [false, 1],
      [false, 0.25],
      [false, 1],
      [true, 1],
      [false, 1],
    ]);

    // A change of language keeps the sound on.
    await page.evaluate(() => document.querySelector("bunraku-stage")!.setAttribute("lang", "ja"));
    await page.waitForFunction(
      () => window.outputs.length === 2 && window.outputs[0].output.context.state === "closed",
    );
    await page.evaluate(() => window.outputs.shift());
    await waitForSound(page, true);
  });
});

/** In the page, before its scripts: record audio outputs and `volumechange` events. */
function recordOutputs(): void {
  Object.assign(window, { outputs: [], changes: [] });
  const connect = AudioNode.prototype.connect as (this: AudioNode, to: AudioNode) => AudioNode;
  AudioNode.prototype.connect = function (this: AudioNode, to: AudioNode) {
    if (to instanceof AudioDestinationNode) {
      const analyser = new AnalyserNode(this.context);
      connect.call(this, analyser);
      window.outputs.push({ output: this as GainNode, analyser });
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

/** Wait until the only output carries sound, or until its audio context is suspended. */
async function waitForSound(page: Page, on: boolean): Promise<void> {
  await page.waitForFunction(
    ({ on, SILENCE_THRESHOLD }) => {
      if (window.outputs.length !== 1) return false;
      const [{ output, analyser }] = window.outputs;
      if (!on) return output.context.state === "suspended";
      const samples = new Float32Array(analyser.fftSize);
      analyser.getFloatTimeDomainData(samples);
      return output.context.state === "running" && samples.some((sample) => Math.abs(sample) > SILENCE_THRESHOLD);
    },
    { on, SILENCE_THRESHOLD },
  );
}

/** Return the state of the stage's sound and the recorded events. */
async function soundState(page: Page) {
  const pressed = await page.getByRole("button", { name: "Sound" }).getAttribute("aria-pressed");
  return page.evaluate((pressed) => {
    const { muted, volume } = document.querySelector("bunraku-stage")!;
    return { muted, volume, pressed, devices: window.outputs.length, changes: window.changes };
  }, pressed);
}
