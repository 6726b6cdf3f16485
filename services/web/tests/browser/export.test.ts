/** Downloads of motions and pictures of the stage. */
import { buffer } from "node:stream/consumers";
import type { Page } from "playwright-core";
import { type AnimationClip, AnimationMixer, type Bone, Vector3 } from "three";
import { BVHLoader } from "three/examples/jsm/loaders/BVHLoader.js";
import { expect, test } from "vitest";
import { JOINTS } from "../../src/motion/skeleton";
import { describeInBrowser, type OpenOptions } from "./browser-suite";
import { createBowingBvh } from "./bvh-file";
import { evaluateInEngine, waitInEngine } from "./engine-probe";
import {
  clickInToast,
  jointPosition,
  LEFT_HAND,
  pauseAtStart,
  ringPosition,
  tapKey,
  waitForFirstPose,
  waitForHold,
  waitForToast,
  waitUntilSettled,
} from "./page-probe";

const CALM: OpenOptions = { viewport: { width: 760, height: 560 }, reducedMotion: "reduce", colorScheme: "dark" };

interface DownloadedFile {
  name: string;
  bytes: Buffer;
}

/** Run `action` and return the file that the page downloads. */
async function captureDownload(page: Page, action: () => Promise<unknown>): Promise<DownloadedFile> {
  const [download] = await Promise.all([page.waitForEvent("download"), action()]);
  return { name: download.suggestedFilename(), bytes: await buffer(await download.createReadStream()) };
}

/** Upload a file and wait for its first pose. */
async function uploadMotion(page: Page, name: string, text: string): Promise<void> {
  await page
    .locator('input[type=file][accept*=".bvh"]')
    .setInputFiles({ name: `${name}.bvh`, mimeType: "text/plain", buffer: Buffer.from(text) });
  await page.locator(".brand-piece", { hasText: name }).waitFor({ state: "attached" });
  await waitForFirstPose(page);
}

/** Download a motion from the open library by keyboard: all performers, or one of them (from 1). */
async function downloadMotion(
  page: Page,
  name: string,
  kind: string,
  performer: number | null = null,
): Promise<DownloadedFile> {
  const disclosure = page.getByRole("button", { name: `Download ${name}`, exact: true });
  await disclosure.focus();
  if ((await disclosure.getAttribute("aria-expanded")) === "false") await page.keyboard.press("Enter");
  const choices = page.getByRole("group", { name: `Download ${name} as`, exact: true });
  const options = performer === null ? choices : choices.getByRole("group", { name: `Dancer ${performer}` });
  const choice = options.getByRole("button", { name: new RegExp(`^${kind},`) });
  await choice.focus();
  return captureDownload(page, () => page.keyboard.press("Enter"));
}

/** Return the joint positions of a BVH file in world coordinates, in metres: one row per frame. */
function jointPositionsIn(file: DownloadedFile): Vector3[][] {
  const { skeleton, clip }: { skeleton: { bones: Bone[] }; clip: AnimationClip } = new BVHLoader().parse(
    file.bytes.toString(),
  );
  const mixer = new AnimationMixer(skeleton.bones[0]);
  mixer.clipAction(clip).play();
  return Array.from({ length: clip.tracks[0].times.length }, (_, frame) => {
    mixer.setTime(Math.min(clip.tracks[0].times[frame], clip.duration - 1e-6));
    skeleton.bones[0].updateMatrixWorld(true);
    return JOINTS.map((joint) => {
      const bone = skeleton.bones.find(({ name }) => name === joint);
      if (!bone) throw new Error(`The file has no joint ${joint}`);
      return new Vector3().setFromMatrixPosition(bone.matrixWorld).multiplyScalar(0.01);
    });
  });
}

function parseGlbJson({ bytes }: DownloadedFile): Record<string, unknown> {
  expect(bytes.subarray(0, 4).toString()).toBe("glTF");
  return JSON.parse(bytes.subarray(20, 20 + bytes.readUInt32LE(12)).toString()) as Record<string, unknown>;
}

describeInBrowser("exports", { server: "open" }, (fixture) => {
  /** Open a page with an open library. */
  async function open(): Promise<Page> {
    const page = await fixture.open("", CALM);
    await waitForFirstPose(page);
    await page.getByRole("button", { name: "Library", exact: true }).click();
    return page;
  }

  test("BVH, GLB and VRMA downloads match the stated codec error", async () => {
    const page = await open();
    await uploadMotion(page, "bowing", createBowingBvh(60));
    const first = await downloadMotion(page, "bowing", "BVH");
    expect(first.name).toBe("bowing.bvh");
    await uploadMotion(page, "again", first.bytes.toString());
    const second = await downloadMotion(page, "again", "BVH");

    const [source, copy] = [jointPositionsIn(first), jointPositionsIn(second)];
    expect(copy).toHaveLength(60);
    const maxError = Math.max(
      ...source.flatMap((positions, frame) =>
        positions.map((position, joint) => position.distanceTo(copy[frame][joint])),
      ),
    );
    const statedError = await evaluateInEngine(
      page,
      () => Math.max(0, ...globalThis.bunraku.viewer.ladder.slice(-1).map(({ max }) => max)) / 1000,
    );
    expect(statedError).toBeGreaterThan(0);
    expect(statedError).toBeLessThan(0.001);
    // The values in both files are rounded.
    expect(maxError).toBeLessThan(statedError + 1e-4);

    const glb = await downloadMotion(page, "again", "GLB");
    expect(glb.name).toBe("again.glb");
    const { images, nodes } = parseGlbJson(glb) as { images: { mimeType: string }[]; nodes: unknown[] };
    expect([images[0].mimeType, nodes.length]).toEqual(["image/png", 21]);
    const vrma = await waitForToast(page, "Saved again.vrma", () => downloadMotion(page, "again", "VRMA"));
    expect(vrma.name).toBe("again.vrma");
    expect(parseGlbJson(vrma)).toHaveProperty(["extensions", "VRMC_vrm_animation", "specVersion"], "1.0");
    await page.locator(".upload").waitFor({ state: "detached" });
    expect(await page.locator(".problem").count()).toBe(0);

    // Escape closes the disclosure, then the library.
    await page.keyboard.press("Escape");
    expect(await page.getByRole("group", { name: "Download again as" }).count()).toBe(0);
    const disclosure = page.getByRole("button", { name: "Download again", exact: true });
    expect(await disclosure.evaluate((element) => element === document.activeElement)).toBe(true);
    await page.keyboard.press("Escape");
    await page.getByRole("complementary", { name: "Library" }).waitFor({ state: "hidden" });
  });

  test("a GLB has all performers; BVH and VRMA have one, as placed", async () => {
    const page = await open();
    await uploadMotion(page, "pair", createBowingBvh(45));
    const alone = jointPositionsIn(await downloadMotion(page, "pair", "BVH"));
    await page.getByRole("button", { name: "Add pair to the stage" }).click();
    await waitInEngine(page, () => globalThis.bunraku.stage.performers.length === 2);
    const glb = await downloadMotion(page, "pair × 2", "GLB");
    expect(glb.name).toBe("pair × 2.glb");
    const { nodes, skins } = parseGlbJson(glb) as { nodes: { name: string }[]; skins: unknown[] };
    expect([nodes.filter(({ name }) => name.startsWith("dancer")).length, skins.length]).toEqual([2, 2]);
    const vrma = await downloadMotion(page, "pair × 2", "VRMA", 1);
    expect(vrma.name).toBe("pair × 2, Dancer 1.vrma");
    const bvh = await waitForToast(page, "Saved pair × 2, Dancer 2.bvh", () =>
      downloadMotion(page, "pair × 2", "BVH", 2),
    );
    expect(bvh.name).toBe("pair × 2, Dancer 2.bvh");

    // The same motion at the placement of the second performer.
    const { x, z, turn } = await evaluateInEngine(page, () => ({
      x: 0,
      z: 0,
      turn: 0,
      ...globalThis.bunraku.viewer.performers[1]?.placement,
    }));
    expect(Math.hypot(x, z)).toBeGreaterThan(0.3);
    const placed = jointPositionsIn(bvh);
    expect(placed).toHaveLength(45);
    const up = new Vector3(0, 1, 0),
      at = new Vector3(x, 0, z);
    const maxError = Math.max(
      ...alone.flatMap((positions, frame) =>
        positions.map((position, joint) => position.applyAxisAngle(up, turn).add(at).distanceTo(placed[frame][joint])),
      ),
    );
    expect(maxError).toBeLessThan(1e-4);
    // It matches the drawn pose, within the error of any bitrate level.
    await pauseAtStart(page);
    const [root, levelError] = await evaluateInEngine(page, () => {
      const { stage, viewer } = globalThis.bunraku;
      return [
        stage.performers[1].joint("humanoid_root").elements.slice(12, 15),
        Math.max(...viewer.ladder.map(({ max }) => max)) / 1000,
      ] as const;
    });
    expect(placed[0][0].distanceTo(new Vector3(...root))).toBeLessThan(levelError + 1e-4);
  });

  test("a cancelled download saves nothing; a failed one shows the problem", async () => {
    const page = await open();
    await uploadMotion(page, "stopped", createBowingBvh(90));
    await page.route("**/description", () => undefined);
    const disclosure = page.getByRole("button", { name: "Download stopped", exact: true });
    await disclosure.click();
    await page.getByRole("button", { name: /^GLB,/ }).click();
    await page.getByRole("button", { name: "Cancel the download of stopped, GLB" }).click();
    await page.locator(".upload").waitFor({ state: "detached" });
    expect(await page.locator(".problem").count()).toBe(0);
    await page.unroute("**/description");
    await page.route("**/description", (route) => route.abort());
    await page.getByRole("button", { name: /^GLB,/ }).click();
    await page.locator(".problem", { hasText: "No answer" }).waitFor();
  });

  test("a picture shows the controlled pose and does not change the stage", async () => {
    const page = await open();
    await uploadMotion(page, "posing", createBowingBvh(75));
    await pauseAtStart(page);
    await page.keyboard.press("Escape");
    await tapKey(page, "Digit2");
    await waitForHold(page, LEFT_HAND);
    const from = await jointPosition(page, "l_wrist");
    await page.keyboard.down("KeyW");
    await waitInEngine(
      page,
      (height) =>
        (globalThis.bunraku.stage.scene.getObjectByName("l_wrist")?.matrixWorld.elements[13] ?? 0) > height + 0.15,
      from[1],
    );
    await page.keyboard.up("KeyW");
    const ring = await waitUntilSettled(page, () => ringPosition(page, LEFT_HAND), 1);
    const before = await drawSettings(page);
    const picture = await waitForToast(page, "Saved posing.png", () =>
      captureDownload(page, () => page.keyboard.press("KeyP")),
    );
    expect(picture.name).toBe("posing.png");
    expect(await drawSettings(page)).toEqual(before);

    // The controlled hand is where the page shows it. The mirrored place is dark, because the other hand hangs lower.
    const found = await page.evaluate(inspectPicture, {
      base64: picture.bytes.toString("base64"),
      points: [ring, { x: 760 - ring.x, y: ring.y }],
    });
    expect([found.width, found.height]).toEqual([1600, 1179]);
    expect(found.colours).toBeGreaterThan(2000);
    expect(found.brightest[0]).toBeGreaterThan(170);
    expect(found.brightest[1]).toBeLessThan(100);

    // A recording can be downloaded from its toast.
    await clickInToast(page, "Download", () => page.keyboard.press("KeyK"));
    await page.getByRole("group", { name: /^Download posing, as .+ pulled it as$/ }).waitFor();
    expect(await page.evaluate(() => document.activeElement?.getAttribute("aria-label"))).toBe(
      "BVH, motion for animation programs",
    );
  });
});

/** Return the stage's materials, shadows and environment, which taking a picture changes temporarily. */
function drawSettings(page: Page) {
  return evaluateInEngine(page, () => {
    const { scene } = globalThis.bunraku.stage;
    const kinds: string[] = [];
    scene.traverse((object) => {
      const { material, castShadow } = object as { material?: { type: string } } & typeof object;
      kinds.push(`${object.name} ${material?.type ?? object.type} ${castShadow}`);
    });
    return { kinds: kinds.sort(), environment: scene.environment?.uuid ?? null };
  });
}

/**
 * In the page: return a picture's size, its number of colours and the brightest value near points of the page (CSS
 * pixels).
 */
async function inspectPicture({ base64, points }: { base64: string; points: { x: number; y: number }[] }) {
  const bitmap = await createImageBitmap(
    new Blob([Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0))], { type: "image/png" }),
  );
  const { width, height } = bitmap;
  const context = new OffscreenCanvas(width, height).getContext("2d") as OffscreenCanvasRenderingContext2D;
  context.drawImage(bitmap, 0, 0);
  const colours = new Set(new Uint32Array(context.getImageData(0, 0, width, height).data.buffer)).size;
  const scale = width / innerWidth;
  const brightest = points.map(({ x, y }) => {
    const { data } = context.getImageData(Math.round(x * scale) - 16, Math.round(y * scale) - 16, 32, 32);
    return Math.max(
      ...Array.from({ length: data.length / 4 }, (_, at) => (data[at * 4] + data[at * 4 + 1] + data[at * 4 + 2]) / 3),
    );
  });
  return { width, height, colours, brightest };
}
