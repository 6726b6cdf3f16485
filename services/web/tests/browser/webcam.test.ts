/** Control of the hands by webcam, with Chromium's fake camera: it shows a person whose arms move. */
import { rmSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import type { Page } from "playwright-core";
import { afterAll, beforeAll, expect, test } from "vitest";
import { HIDDEN_TIMEOUT_MS } from "../../src/app/webcam-controller";
import { fakeCamera, writeFilm } from "../webcam/film";
import { findViolations } from "./accessibility";
import { describeInBrowser, type OpenOptions } from "./browser-suite";
import { waitInEngine } from "./engine-probe";
import {
  LEFT_HAND,
  pauseAtStart,
  waitForFirstPose,
  waitForHold,
  waitForPerformers,
  waitForRelease,
} from "./page-probe";

const RIGHT_HAND = 1;
const FILM = join(tmpdir(), `bunraku-film-${process.pid}.y4m`);
/** Times of the performance: arms down, and both arms to the sides. */
const [ARMS_DOWN_S, ARMS_ASIDE_S] = [1, 7.4];

const OPTIONS: OpenOptions = { viewport: { width: 1100, height: 720 }, reducedMotion: "reduce" };

declare global {
  interface Window {
    /** Tracks of the cameras that the page has opened. */
    cameraTracks: MediaStreamTrack[];
    /** Runs the callback of the captured timer. */
    runTimer?: () => void;
  }
}

/** Record the tracks of the cameras that a page opens. */
async function recordTracks(page: Page): Promise<void> {
  await page.addInitScript(() => {
    window.cameraTracks = [];
    const { mediaDevices } = navigator;
    const open = mediaDevices.getUserMedia.bind(mediaDevices);
    mediaDevices.getUserMedia = async (constraints) => {
      const stream = await open(constraints);
      window.cameraTracks.push(...stream.getTracks());
      return stream;
    };
  });
}

/** Keep the callback of a timer of this duration, instead of waiting for it. */
function captureTimer(duration: number): void {
  const start = window.setTimeout.bind(window);
  window.setTimeout = ((callback: () => void, delay?: number, ...rest: unknown[]) => {
    if (delay !== duration) return start(callback, delay, ...rest);
    window.runTimer = callback;
    return 0;
  }) as typeof window.setTimeout;
}

const trackStates = (page: Page) => page.evaluate(() => window.cameraTracks.map(({ readyState }) => readyState));

async function startCamera(page: Page): Promise<void> {
  await waitForFirstPose(page);
  await page.getByRole("button", { name: "Strings", exact: true }).click();
  await page.getByRole("button", { name: "Use my camera" }).click();
}

describeInBrowser("webcam", { server: "open", browser: fakeCamera(FILM) }, (fixture) => {
  const { open } = fixture;
  beforeAll(() => {
    const times = [...Array(30).fill(ARMS_DOWN_S), ...Array(60).fill(ARMS_ASIDE_S)];
    writeFilm(FILM, { times, view: { distance: 2.2, height: 1.15, fov: 45 } });
  });
  afterAll(() => rmSync(FILM, { force: true }));

  test("the hands before it hold the performer's hands; nothing leaves the page", async () => {
    const requests: string[] = [];
    const page = await open("", {
      ...OPTIONS,
      before: async (page) => {
        page.context().on("request", (request) => requests.push(request.url()));
        await recordTracks(page);
      },
    });
    await startCamera(page);
    await pauseAtStart(page);
    const card = page.getByRole("region", { name: "Camera" });
    await waitForHold(page, LEFT_HAND);
    await waitForHold(page, RIGHT_HAND);
    await card.getByText("Your hands move the hands on the stage").waitFor();
    // The person's arms are to the sides for a while, then down, again and again.
    for (const [wrist, sign] of [
      ["l_wrist", 1],
      ["r_wrist", -1],
    ] as const) {
      await waitInEngine(page, isAside, { wrist, sign, from: 0.45, to: 2, performer: 0 });
      await waitInEngine(page, isAside, { wrist, sign, from: -1, to: 0.35, performer: 0 });
    }
    expect(await findViolations(page)).toEqual([]);
    expect(await trackStates(page)).toEqual(["live"]);

    await page.keyboard.press("Escape");
    await waitForRelease(page, LEFT_HAND);
    await waitForRelease(page, RIGHT_HAND);
    await card.getByRole("button", { name: "Stop the camera" }).click();
    await card.waitFor({ state: "hidden" });
    expect(await trackStates(page)).toEqual(["ended"]);
    await page.getByRole("button", { name: "Use my camera" }).waitFor();

    const isOwn = (address: string) => {
      const { origin, protocol } = new URL(address);
      return origin === new URL(page.url()).origin || protocol === "blob:" || protocol === "data:";
    };
    expect(requests.filter((address) => !isOwn(address))).toEqual([]);
    const models = requests.filter((address) => /\.(wasm|tflite|data|binarypb)$/.test(address));
    expect(models.map((address) => address.replace(/^.*\//, "").replace(/-.{8}\.\w+$/, "")).sort()).toEqual([
      "pose_landmark_lite",
      "pose_solution_packed_assets",
      "pose_solution_simd_wasm_bin",
      "pose_web",
    ]);
  });

  test("the whole body before it is a live performer, whose motion is kept", async () => {
    const page = await open("?name=Aiko", { ...OPTIONS, before: recordTracks });
    await startCamera(page);
    const card = page.getByRole("region", { name: "Camera" });
    await waitForHold(page, LEFT_HAND);
    await card.getByText("Whole body").click();
    await waitForRelease(page, LEFT_HAND);
    await card.getByText("You are live on the stage").waitFor();
    await waitForPerformers(page, 2);
    expect(await page.locator(".live").innerText()).toMatch(/^Live\s+Aiko$/);
    // The second performer: true to the side, not as in a mirror, and while the first one dances on.
    for (const [wrist, sign] of [
      ["l_wrist", 1],
      ["r_wrist", -1],
    ] as const) {
      await waitInEngine(page, isAside, { wrist, sign, from: 0.45, to: 2, performer: 1 });
      await waitInEngine(page, isAside, { wrist, sign, from: -1, to: 0.35, performer: 1 });
    }
    expect(await findViolations(page)).toEqual([]);
    await card.getByRole("button", { name: "Stop the camera" }).click();
    await waitForPerformers(page, 1);
    expect(await trackStates(page)).toEqual(["ended"]);
    await page.getByText(/^Kept: Aiko/).waitFor();
    await page.getByRole("button", { name: "Dance it" }).click();
    await page.locator(".brand-piece").getByText(/^Aiko/).waitFor();
  });

  test("a performance that cannot begin, and one that is ended elsewhere, can be tried again", async () => {
    const page = await open("?name=Aiko", OPTIONS);
    await page.route("**/v1/performers", (route) => route.abort());
    await startCamera(page);
    const card = page.getByRole("region", { name: "Camera" });
    await card.getByText("Whole body").click();
    await card.getByRole("alert").getByText("the server cannot be reached").waitFor();
    await page.unroute("**/v1/performers");
    const created = page.waitForResponse((response) => response.url().endsWith("/v1/performers") && response.ok());
    await card.getByRole("button", { name: "Try again" }).click();
    const { id } = (await (await created).json()) as { id: string };
    await card.getByText(/^You are live on the stage/).waitFor();
    expect(await card.getByRole("alert").isVisible()).toBe(false);

    await fixture.request("DELETE", `/v1/performers/${id}`);
    await card.getByRole("alert").getByText("Your performance has ended").waitFor();
    await card.getByRole("button", { name: "Try again" }).click();
    await card.getByText(/^You are live on the stage/).waitFor();
    await card.getByRole("button", { name: "Stop the camera" }).click();
    await waitForPerformers(page, 1);
  });

  test("loading is shown, can be cancelled, and a model that does not arrive is reported", async () => {
    const page = await open("", { ...OPTIONS, before: recordTracks });
    await page.context().route("**/*.tflite", (route) => route.abort());
    await startCamera(page);
    const card = page.getByRole("region", { name: "Camera" });
    await card.getByRole("alert").getByText("You cannot be detected here").waitFor();
    expect(await findViolations(page)).toEqual([]);
    expect(await trackStates(page)).toEqual(["ended"]);
    let release = (): void => undefined;
    const released = new Promise<void>((resolve) => (release = resolve));
    await page.context().unroute("**/*.tflite");
    await page.context().route("**/*.tflite", async (route) => {
      await released;
      await route.continue();
    });
    await card.getByRole("button", { name: "Try again" }).click();
    await card.getByRole("progressbar").waitFor();
    await card.getByText(/^Loading the detector: \d+%$/).waitFor();
    await card.getByRole("button", { name: "Stop the camera" }).click();
    expect(await trackStates(page)).toEqual(["ended", "ended"]);
    expect(await card.count()).toBe(0);
    release();
  });

  test("a hidden page releases the hands at once, and the camera after a while", async () => {
    const page = await open("", {
      ...OPTIONS,
      before: async (page) => {
        await recordTracks(page);
        await page.addInitScript(captureTimer, HIDDEN_TIMEOUT_MS);
      },
    });
    await startCamera(page);
    await waitForHold(page, LEFT_HAND);
    await setHidden(page, true);
    await waitForRelease(page, LEFT_HAND);
    expect(await trackStates(page)).toEqual(["live"]);
    await page.evaluate(() => window.runTimer?.());
    expect(await trackStates(page)).toEqual(["ended"]);
    await setHidden(page, false);
    await page.getByText("The camera was switched off while this page was hidden").waitFor();
    expect(await page.getByRole("region", { name: "Camera" }).count()).toBe(0);
  });
});

describeInBrowser("webcam of a browser without a camera", { server: "open" }, ({ open }) => {
  test("says what is missing, in Japanese too", async () => {
    const page = await open("", OPTIONS);
    await startCamera(page);
    const card = page.getByRole("region", { name: "Camera" });
    await card.getByRole("alert").getByText("There is no camera").waitFor();
    await card.getByRole("button", { name: "Stop the camera" }).click();
    await card.waitFor({ state: "hidden" });

    const japanese = await open("?lang=ja", OPTIONS);
    await waitForFirstPose(japanese);
    await japanese.getByRole("button", { name: "糸", exact: true }).click();
    await japanese.getByRole("button", { name: "カメラを使う" }).click();
    await japanese.getByRole("alert").getByText("カメラがありません").waitFor();
  });
});

interface Aside {
  readonly wrist: string;
  readonly sign: number;
  readonly from: number;
  readonly to: number;
  readonly performer: number;
}

/** Whether a performer's wrist is between two distances from the chest, to the side of `sign`. */
function isAside({ wrist, sign, from, to, performer }: Aside): boolean {
  const figure = globalThis.bunraku.stage.performers[performer];
  if (!figure) return false;
  const [at, chest] = [figure.joint(wrist).elements, figure.joint("vl5").elements];
  const distance = [0, 1, 2].reduce((sum, axis) => sum + chest[axis] * (at[12 + axis] - chest[12 + axis]), 0) * sign;
  return distance > from && distance < to;
}

/** Put the page into the background, or bring it back, as far as the page can see. */
async function setHidden(page: Page, isHidden: boolean): Promise<void> {
  await page.evaluate((hidden) => {
    Object.defineProperty(document, "hidden", { configurable: true, get: () => hidden });
    document.dispatchEvent(new Event("visibilitychange"));
  }, isHidden);
}
