/** VR: an emulated headset enters the stage, and its controllers and hands hold strings. */
import type { Page } from "playwright-core";
import { expect, test } from "vitest";
import { createFigureFile } from "../avatar/figure-files";
import { findViolations } from "./accessibility";
import { describeInBrowser, type OpenOptions } from "./browser-suite";
import { evaluateInEngine } from "./engine-probe";
import {
  connectHeadset,
  enterVr,
  leaveVr,
  moveHand,
  pinch,
  pretendGraphicsProcessor,
  readMaterial,
  reportGraphicsLoss,
  ringInRoom,
  setButton,
  showMenu,
  trackHands,
  turnThumbstick,
  waitForAvatar,
  waitForGrip,
} from "./headset";
import {
  LEFT_HAND,
  type Position,
  pauseAtStart,
  stopDrawing,
  tapKey,
  waitForFirstPose,
  waitForHold,
  waitForRelease,
  waitForToast,
  waitForWelcome,
} from "./page-probe";

const RIGHT_HAND = 1;
/** Small, as an emulated headset draws in software. */
const OPTIONS: OpenOptions = { viewport: { width: 480, height: 360 }, reducedMotion: "reduce" };
/** Movement of a hand on the stage, up and towards the audience, and how far the ring may be from it, in metres. */
const MOVEMENT_M: Position = [0, 0.2, 0.3];
const TOLERANCE_M = 0.02;

describeInBrowser("VR", { server: "open" }, (fixture) => {
  async function open(name: string, options: OpenOptions = {}): Promise<Page> {
    const page = await fixture.open(`?name=${name}`, { ...OPTIONS, ...options });
    await waitForFirstPose(page);
    await waitForWelcome(page);
    return page;
  }

  /** Open a page with a headset, paused where the hands hang down, and enter VR. Errors in its frames fail the test. */
  async function openInVr(name: string, before: OpenOptions["before"] = connectHeadset): Promise<Page> {
    const page = await open(name, { before });
    page.on("console", (message) => {
      if (message.type() === "error") throw new Error(message.text());
    });
    await pauseAtStart(page);
    await enterVr(page);
    return page;
  }

  /** Open the page of another viewer, which leaves the processor to the headset. */
  async function openViewer(): Promise<Page> {
    const page = await open("Mateo");
    await stopDrawing(page);
    return page;
  }

  /** Close a hand on a ring by `close`, move it, and expect that `viewer` sees the same movement of the ring. */
  async function pull(page: Page, viewer: Page, { side, limb, scale = 1, close }: PullOptions): Promise<void> {
    const before = await ringOnStage(viewer, limb);
    const ring = await ringInRoom(page, limb);
    await moveHand(page, side, ring);
    await waitForGrip(page, side, "open", limb);
    await close();
    await waitForGrip(page, side, "holding", limb);
    await waitForHold(page, limb);
    await moveHand(page, side, add(ring, MOVEMENT_M, scale));
    const target = add(before, MOVEMENT_M);
    const error = async () => Math.hypot(...add(await ringOnStage(viewer, limb), target, -1));
    await expect.poll(error).toBeLessThan(TOLERANCE_M);
  }

  test("a controller holds a string, and another viewer sees the limb follow it", async () => {
    const origin = new URL(fixture.url).origin;
    const requests: string[] = [];
    const page = await openInVr("Aiko", async (page) => {
      page.on("request", (request) => requests.push(request.url()));
      await connectHeadset(page);
    });
    const viewer = await openViewer();
    const trigger = (value: number) => setButton(page, "right", "trigger", value);
    await pull(page, viewer, { side: "right", limb: LEFT_HAND, close: () => trigger(1) });
    await pull(page, viewer, { side: "left", limb: RIGHT_HAND, close: () => setButton(page, "left", "squeeze", 1) });
    // The same puppeteer holds both; no second one has come.
    expect(await viewer.locator(".avatars span").count()).toBe(2);
    expect(await page.evaluate(allowsTracking)).toBe(true);
    await trigger(0);
    await waitForRelease(page, LEFT_HAND);
    await waitForHold(page, RIGHT_HAND);
    await leaveVr(page);
    await waitForRelease(page, RIGHT_HAND);
    await waitForWelcome(page);
    await tapKey(page, "Digit2");
    await waitForHold(page, LEFT_HAND);
    expect(requests.some((url) => url.includes("/assets/session-chunk-"))).toBe(true);
    expect(requests.filter((url) => new URL(url).origin !== origin && !url.startsWith("blob:"))).toEqual([]);
  });

  test("a tracked hand holds a string by a pinch, also of a stage at a quarter of its size", async () => {
    const [page, viewer] = [await openInVr("Aiko"), await openViewer()];
    await trackHands(page);
    await page.evaluate(() => document.querySelector<HTMLElement>(".immersive-size")?.click());
    await expect.poll(async () => (await ringInRoom(page, LEFT_HAND))[1]).toBeGreaterThan(0.9);
    await pull(page, viewer, { side: "right", limb: LEFT_HAND, scale: 0.25, close: () => pinch(page, "right", 1) });
    await pinch(page, "right", 0);
    await waitForRelease(page, LEFT_HAND);
  });

  test("a string that another puppeteer holds is asked for while the hand is closed on it", async () => {
    const [page, other] = [await openInVr("Aiko"), await open("Mateo")];
    await stopDrawing(other);
    await tapKey(other, "Digit2");
    await waitForHold(other, LEFT_HAND);
    await page.waitForFunction(() => document.querySelectorAll(".avatars span").length === 2);
    await moveHand(page, "right", await ringInRoom(page, LEFT_HAND));
    await waitForGrip(page, "right", "open", LEFT_HAND);
    const request = other.getByText("Aiko asks for the left hand");
    await setButton(page, "right", "trigger", 1);
    await waitForGrip(page, "right", "asking", LEFT_HAND);
    await request.waitFor();
    expect(await evaluateInEngine(other, () => globalThis.bunraku.puppeteer.holds(0))).toBe(true);
    // Opening the hand withdraws the request.
    await setButton(page, "right", "trigger", 0);
    await request.waitFor({ state: "detached" });
    await setButton(page, "right", "trigger", 1);
    await request.waitFor();
    await other.keyboard.press("KeyG");
    await waitForGrip(page, "right", "holding", LEFT_HAND);
    await waitForHold(page, LEFT_HAND);
    await setButton(page, "right", "trigger", 0);
    await waitForRelease(page, LEFT_HAND);
  });

  test("the next of several performers comes before the viewer, and the view turns", async () => {
    const page = await openInVr("Aiko");
    const { motion } = fixture;
    const { id } = await fixture.request<{ id: string }>("POST", `/v1/motions/${motion}/performers`, {
      motions: [motion],
    });
    await fixture.request("PATCH", `/v1/sessions/${fixture.session}`, { motion: id, position: 0 });
    const sideOf = async (performer: number) => {
      const [left, right] = await Promise.all([0, 1].map((hand) => ringInRoom(page, 4 * performer + hand)));
      return left && right ? (left[0] + right[0]) / 2 : null;
    };
    await expect.poll(() => sideOf(1)).not.toBe(null);
    await expect.poll(() => sideOf(0)).toBeCloseTo(0, 1);
    expect(Math.abs((await sideOf(1)) ?? 0)).toBeGreaterThan(0.5);
    await setButton(page, "left", "x-button", 1);
    await expect.poll(() => sideOf(1)).toBeCloseTo(0, 1);
    await moveHand(page, "right", await ringInRoom(page, 4 + RIGHT_HAND));
    await setButton(page, "right", "trigger", 1);
    await waitForHold(page, 4 + RIGHT_HAND);
    await setButton(page, "right", "trigger", 0);
    await waitForRelease(page, 4 + RIGHT_HAND);
    const [before] = await ringInRoom(page, 4);
    await turnThumbstick(page, "right", 1);
    await expect.poll(async () => (await ringInRoom(page, 4))[0]).toBeLessThan(before - 0.3);
  });

  test("strings are let go while a menu of the system is shown, and when the graphics are lost", async () => {
    // The engine runs in the page, too.
    const page = await openInVr("Aiko&engine=page");
    const take = async () => {
      await moveHand(page, "right", await ringInRoom(page, LEFT_HAND));
      await setButton(page, "right", "trigger", 1);
      await waitForHold(page, LEFT_HAND);
    };
    await take();
    await showMenu(page, true);
    await waitForRelease(page, LEFT_HAND);
    await showMenu(page, false);
    await setButton(page, "right", "trigger", 0);
    await waitForGrip(page, "right", "open", LEFT_HAND);
    await take();
    await waitForToast(page, "VR has ended", () => reportGraphicsLoss(page));
    await waitForRelease(page, LEFT_HAND);
    await setButton(page, "right", "trigger", 0);
    await enterVr(page);
    await take();
  });

  test("a headset that draws too slowly gets a simpler puppet", async () => {
    const page = await open("Aiko", {
      // Tiny, as the puppet of graphics processors is drawn in software.
      viewport: { width: 240, height: 180 },
      before: async (page) => {
        await pretendGraphicsProcessor(page);
        await connectHeadset(page);
      },
    });
    await pauseAtStart(page);
    await stopDrawing(page);
    await enterVr(page);
    expect(await readMaterial(page)).toEqual({ type: "MeshPhysicalMaterial", invalidPrograms: 0 });
    await expect.poll(() => readMaterial(page)).toEqual({ type: "ShaderMaterial", invalidPrograms: 0 });
  });

  test("an avatar dances in VR, too", async () => {
    const page = await open("Aiko", { before: connectHeadset });
    const figure = { name: "mine.glb", mimeType: "model/gltf-binary", buffer: Buffer.from(createFigureFile({})) };
    await waitForToast(page, "mine dances here", () =>
      page.locator('input[type="file"]').first().setInputFiles(figure),
    );
    // Closes the library.
    await page.keyboard.press("Escape");
    await pauseAtStart(page);
    await enterVr(page);
    await waitForAvatar(page);
    await moveHand(page, "right", await ringInRoom(page, LEFT_HAND));
    await setButton(page, "right", "trigger", 1);
    await waitForHold(page, LEFT_HAND);
    await leaveVr(page);
    await waitForRelease(page, LEFT_HAND);
  });

  test("a session that is refused is reported, and so is a chunk that does not load", async () => {
    const page = await open("Aiko", { before: connectHeadset });
    await page.route("**/assets/session-chunk-*.js", (route) => route.abort());
    await page.getByRole("button", { name: "Enter VR" }).focus();
    expect(await findViolations(page)).toEqual([]);
    const enter = () => page.keyboard.press("Enter");
    await waitForToast(page, "VR could not be loaded", enter);
    await page.evaluate(() => {
      (navigator.xr as XRSystem).requestSession = () => Promise.reject(new DOMException("", "NotAllowedError"));
    });
    await waitForToast(page, "VR could not start", enter);
    // The page goes on.
    await tapKey(page, "Digit2");
    await waitForHold(page, LEFT_HAND);
  });

  test("a browser without VR shows no button and loads nothing of it", async () => {
    const loaded: string[] = [];
    const page = await open("Aiko", {
      before: async (page) => void page.on("request", (request) => loaded.push(request.url())),
    });
    await page.waitForFunction(() => !("arriving" in document.documentElement.dataset));
    expect(await page.getByRole("button", { name: "Enter VR" }).count()).toBe(0);
    expect(loaded.filter((url) => /immersive|session-chunk/.test(url))).toEqual([]);
  });
});

interface PullOptions {
  side: "left" | "right";
  limb: number;
  /** Metres of the room per metre of the stage. */
  scale?: number;
  close(): Promise<void>;
}

/** Return the position of a limb's ring on a viewer's stage, in metres. */
function ringOnStage(page: Page, limb: number): Promise<Position> {
  return evaluateInEngine(
    page,
    (limb) => {
      const { stage } = globalThis.bunraku;
      return stage.performers[0].handle(limb, stage.rig.group.position.clone()).toArray() as Position;
    },
    limb,
  );
}

/** Return `a` plus `b` times `scale`. */
function add(a: Position, b: Position, scale = 1): Position {
  return a.map((value, axis) => value + scale * b[axis]) as Position;
}

/** Return whether the server's headers allow the page to follow a headset. */
function allowsTracking(): boolean {
  const { featurePolicy } = document as unknown as { featurePolicy: { allowsFeature(name: string): boolean } };
  return featurePolicy.allowsFeature("xr-spatial-tracking");
}
