/** Dances downloaded from the page and pictures of the stage, in a real browser. */
import { readFile } from "node:fs/promises";
import type { Page } from "playwright-core";
import { type AnimationClip, AnimationMixer, type Bone, Vector3 } from "three";
import { BVHLoader } from "three/examples/jsm/loaders/BVHLoader.js";
import { expect, test } from "vitest";
import { JOINTS } from "../../src/motion/skeleton";
import { describeInBrowser, type OpenOptions } from "./browser-suite";
import { createBowingBvh } from "./bvh-file";
import {
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

interface Saved {
  name: string;
  bytes: Buffer;
}

/** The file that the page saves once `act` is done. */
async function saved(page: Page, act: () => Promise<unknown>): Promise<Saved> {
  const [download] = await Promise.all([page.waitForEvent("download"), act()]);
  return { name: download.suggestedFilename(), bytes: await readFile(await download.path()) };
}

/** Uploads a file, and waits until it is danced. */
async function dances(page: Page, name: string, text: string): Promise<void> {
  await page
    .locator('input[type=file][accept*=".bvh"]')
    .setInputFiles({ name: `${name}.bvh`, mimeType: "text/plain", buffer: Buffer.from(text) });
  await page.locator(".brand-piece", { hasText: name }).waitFor({ state: "attached" });
  await waitForFirstPose(page);
}

/** Downloads a dance from the open library by keyboard alone; of several dancers one's own, by number from 1, or all. */
async function downloaded(page: Page, name: string, kind: string, dancer: number | null = null): Promise<Saved> {
  const disclosing = page.getByRole("button", { name: `Download ${name}`, exact: true });
  await disclosing.focus();
  if ((await disclosing.getAttribute("aria-expanded")) === "false") await page.keyboard.press("Enter");
  const choices = page.getByRole("group", { name: `Download ${name} as`, exact: true });
  const offered = dancer === null ? choices : choices.getByRole("group", { name: `Dancer ${dancer}` });
  const choice = offered.getByRole("button", { name: new RegExp(`^${kind},`) });
  await choice.focus();
  return saved(page, () => page.keyboard.press("Enter"));
}

/** World places of all joints, metres, frame by frame. */
function placesIn(file: Saved): Vector3[][] {
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
      if (!bone) throw new Error(`no ${joint} in the file`);
      return new Vector3().setFromMatrixPosition(bone.matrixWorld).multiplyScalar(0.01);
    });
  });
}

function jsonOf({ bytes }: Saved): Record<string, unknown> {
  expect(bytes.subarray(0, 4).toString()).toBe("glTF");
  return JSON.parse(bytes.subarray(20, 20 + bytes.readUInt32LE(12)).toString()) as Record<string, unknown>;
}

describeInBrowser("what is taken from the page", {}, ({ open }) => {
  test("a dance is downloaded as each kind of file; a second generation is as near to the first as its rate says", async () => {
    const page = await open("", CALM);
    await dances(page, "bowing", createBowingBvh(60));
    const first = await downloaded(page, "bowing", "BVH");
    expect(first.name).toBe("bowing.bvh");
    await dances(page, "again", first.bytes.toString());
    const second = await downloaded(page, "again", "BVH");

    const [source, copy] = [placesIn(first), placesIn(second)];
    expect(copy).toHaveLength(60);
    const most = Math.max(
      ...source.flatMap((places, frame) => places.map((place, joint) => place.distanceTo(copy[frame][joint]))),
    );
    const stated = await page.evaluate(
      () => Math.max(0, ...window.bunraku.viewer.ladder.slice(-1).map(({ max }) => max)) / 1000,
    );
    expect(stated).toBeGreaterThan(0);
    expect(stated).toBeLessThan(0.001);
    // and what is rounded in the two files
    expect(most).toBeLessThan(stated + 1e-4);

    const glb = await downloaded(page, "again", "GLB");
    expect(glb.name).toBe("again.glb");
    const { images, nodes } = jsonOf(glb) as { images: { mimeType: string }[]; nodes: unknown[] };
    expect([images[0].mimeType, nodes.length]).toEqual(["image/png", 21]);
    const vrma = await waitForToast(page, "Saved again.vrma", () => downloaded(page, "again", "VRMA"));
    expect(vrma.name).toBe("again.vrma");
    expect(jsonOf(vrma)).toHaveProperty(["extensions", "VRMC_vrm_animation", "specVersion"], "1.0");
    await page.locator(".upload").waitFor({ state: "detached" });
    expect(await page.locator(".problem").count()).toBe(0);

    // Escape shuts what was disclosed, then the library
    await page.keyboard.press("Escape");
    expect(await page.getByRole("group", { name: "Download again as" }).count()).toBe(0);
    const disclosing = page.getByRole("button", { name: "Download again", exact: true });
    expect(await disclosing.evaluate((one) => one === document.activeElement)).toBe(true);
    await page.keyboard.press("Escape");
    await page.getByRole("complementary", { name: "Library" }).waitFor({ state: "hidden" });
  });

  test("of several dancers all are in one GLB; motion is downloaded of each, as it stands on the stage", async () => {
    const page = await open("", CALM);
    await dances(page, "pair", createBowingBvh(45));
    const alone = placesIn(await downloaded(page, "pair", "BVH"));
    await page.getByRole("button", { name: "Add pair to the stage" }).click();
    await page.waitForFunction(() => window.bunraku.stage.performers.length === 2);
    const glb = await downloaded(page, "pair × 2", "GLB");
    expect(glb.name).toBe("pair × 2.glb");
    const { nodes, skins } = jsonOf(glb) as { nodes: { name: string }[]; skins: unknown[] };
    expect([nodes.filter(({ name }) => name.startsWith("dancer")).length, skins.length]).toEqual([2, 2]);
    const vrma = await downloaded(page, "pair × 2", "VRMA", 1);
    expect(vrma.name).toBe("pair × 2, Dancer 1.vrma");
    const bvh = await waitForToast(page, "Saved pair × 2, Dancer 2.bvh", () => downloaded(page, "pair × 2", "BVH", 2));
    expect(bvh.name).toBe("pair × 2, Dancer 2.bvh");

    // the same dance, brought to the second one's place
    const { x, z, turn } = await page.evaluate(() => ({
      x: 0,
      z: 0,
      turn: 0,
      ...window.bunraku.viewer.performers[1]?.placement,
    }));
    expect(Math.hypot(x, z)).toBeGreaterThan(0.3);
    const placed = placesIn(bvh);
    expect(placed).toHaveLength(45);
    const up = new Vector3(0, 1, 0),
      at = new Vector3(x, 0, z);
    const most = Math.max(
      ...alone.flatMap((places, frame) =>
        places.map((place, joint) => place.applyAxisAngle(up, turn).add(at).distanceTo(placed[frame][joint])),
      ),
    );
    expect(most).toBeLessThan(1e-4);
    // and where it is seen, at whatever rate it came
    await pauseAtStart(page);
    const [root, worst] = await page.evaluate(() => {
      const { stage, viewer } = window.bunraku;
      return [
        stage.performers[1].joint("humanoid_root").elements.slice(12, 15),
        Math.max(...viewer.ladder.map(({ max }) => max)) / 1000,
      ] as const;
    });
    expect(placed[0][0].distanceTo(new Vector3(...root))).toBeLessThan(worst + 1e-4);
  });

  test("a download that is given up saves nothing; one whose blocks are gone says so", async () => {
    const page = await open("", CALM);
    await dances(page, "stopped", createBowingBvh(90));
    await page.route("**/description", () => undefined);
    const disclosing = page.getByRole("button", { name: "Download stopped", exact: true });
    await disclosing.click();
    await page.getByRole("button", { name: /^GLB,/ }).click();
    await page.getByRole("button", { name: "Cancel the download of stopped, GLB" }).click();
    await page.locator(".upload").waitFor({ state: "detached" });
    expect(await page.locator(".problem").count()).toBe(0);
    await page.unroute("**/description");
    await page.route("**/description", (route) => route.abort());
    await page.getByRole("button", { name: /^GLB,/ }).click();
    await page.locator(".problem", { hasText: "No answer" }).waitFor();
  });

  test("a picture shows the stage with the pulled pose, in full quality, and leaves the stage as it was", async () => {
    const page = await open("", CALM);
    await dances(page, "posing", createBowingBvh(75));
    await pauseAtStart(page);
    await page.keyboard.press("Escape");
    await tapKey(page, "Digit2");
    await waitForHold(page, LEFT_HAND);
    const from = await jointPosition(page, "l_wrist");
    await page.keyboard.down("KeyW");
    await page.waitForFunction(
      (height) =>
        (window.bunraku.stage.scene.getObjectByName("l_wrist")?.matrixWorld.elements[13] ?? 0) > height + 0.15,
      from[1],
    );
    await page.keyboard.up("KeyW");
    const ring = await waitUntilSettled(page, () => ringPosition(page, LEFT_HAND), 1);
    const before = await look(page);
    const picture = await waitForToast(page, "Saved posing.png", () => saved(page, () => page.keyboard.press("KeyP")));
    expect(picture.name).toBe("posing.png");
    expect(await look(page)).toEqual(before);

    // the pulled hand is where it is on the page; the other hangs lower, and where it would mirror this one is the dark
    const found = await page.evaluate(seen, {
      base64: picture.bytes.toString("base64"),
      places: [ring, { x: 760 - ring.x, y: ring.y }],
    });
    expect([found.width, found.height]).toEqual([1600, 1179]);
    expect(found.colours).toBeGreaterThan(2000);
    expect(found.brightest[0]).toBeGreaterThan(170);
    expect(found.brightest[1]).toBeLessThan(100);

    // what is kept may be taken along at once
    await page.keyboard.press("KeyK");
    await page.locator(".toast", { hasText: "Kept: posing" }).getByRole("button", { name: "Download" }).click();
    await page.getByRole("group", { name: /^Download posing, as .+ pulled it as$/ }).waitFor();
    expect(await page.evaluate(() => document.activeElement?.getAttribute("aria-label"))).toBe(
      "BVH, motion for animation programs",
    );
  });
});

/** What the stage draws with, as far as a picture changes it for a moment. */
function look(page: Page) {
  return page.evaluate(() => {
    const { scene } = window.bunraku.stage;
    const kinds: string[] = [];
    scene.traverse((one) => {
      const { material, castShadow } = one as { material?: { type: string } } & typeof one;
      kinds.push(`${one.name} ${material?.type ?? one.type} ${castShadow}`);
    });
    return { kinds: kinds.sort(), environment: scene.environment?.uuid ?? null };
  });
}

/** In the page: a picture's size, how many colours are in it, and the brightest about places of the page, CSS pixels. */
async function seen({ base64, places }: { base64: string; places: { x: number; y: number }[] }) {
  const bitmap = await createImageBitmap(
    new Blob([Uint8Array.from(atob(base64), (letter) => letter.charCodeAt(0))], { type: "image/png" }),
  );
  const { width, height } = bitmap;
  const context = new OffscreenCanvas(width, height).getContext("2d") as OffscreenCanvasRenderingContext2D;
  context.drawImage(bitmap, 0, 0);
  const colours = new Set(new Uint32Array(context.getImageData(0, 0, width, height).data.buffer)).size;
  const scale = width / innerWidth;
  const brightest = places.map(({ x, y }) => {
    const { data } = context.getImageData(Math.round(x * scale) - 16, Math.round(y * scale) - 16, 32, 32);
    return Math.max(
      ...Array.from({ length: data.length / 4 }, (_, at) => (data[at * 4] + data[at * 4 + 1] + data[at * 4 + 2]) / 3),
    );
  });
  return { width, height, colours, brightest };
}
