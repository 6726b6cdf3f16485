/**
 * Avatars loaded by the viewer: they replace the puppet, can be controlled, are stored in the browser and are never
 * uploaded.
 */
import type { Page } from "playwright-core";
import { expect, test } from "vitest";
import { mixamoName } from "../avatar/figure-bones";
import { createFigureFile, type FigureOptions } from "../avatar/figure-files";
import { findViolations } from "./accessibility";
import { dropBytes } from "./avatar-drop";
import { describeInBrowser } from "./browser-suite";
import { evaluateInEngine, waitInEngine } from "./engine-probe";
import {
  LEFT_HAND,
  pauseAtStart,
  readPrograms,
  ringPosition,
  waitForDraw,
  waitForFirstPose,
  waitForPerformers,
  waitForRelease,
  waitForToast,
  waitForWelcome,
  waitUntilSettled,
} from "./page-probe";

const SMALL = { viewport: { width: 640, height: 560 }, reducedMotion: "reduce" } as const;
/** Index of the first limb of the second performer. */
const SECOND_PERFORMER = 4;
/** A figure with Mixamo bone names and proportions that differ from the performer's. */
const MIXAMO_FIGURE: FigureOptions = {
  name: mixamoName,
  unit: 0.01,
  askew: true,
  arms: 40,
  forearm: 0.8,
  legLength: 0.85,
  dressed: true,
};

describeInBrowser("avatars", { server: "open" }, ({ open }) => {
  test("a dropped avatar replaces the puppet and is not uploaded", async () => {
    const uploads: string[] = [];
    const before = async (page: Page) => {
      page.on(
        "request",
        (request) => request.method() !== "GET" && uploads.push(`${request.method()} ${request.url()}`),
      );
    };
    const page = await open("", { ...SMALL, before });
    await waitForFirstPose(page);
    await waitForWelcome(page);
    await pauseAtStart(page);
    uploads.length = 0;
    await waitForToast(page, "mine dances here; everyone else sees the puppet", () =>
      drop(page, "mine.glb", MIXAMO_FIGURE),
    );
    expect(await page.getByRole("radio", { name: "mine" }).isChecked()).toBe(true);
    await waitForFirstPose(page);
    await waitInEngine(page, () => globalThis.bunraku.stage.puppet?.group.getObjectByName("figure") === undefined);
    expect(await limbAngleError(page)).toBeLessThan(1);
    expect((await readPrograms(page)).filter(({ isValid }) => !isValid)).toEqual([]);
    await page.keyboard.press("Escape");

    await dragHand(page, LEFT_HAND);
    await page.mouse.up();
    await waitForRelease(page, LEFT_HAND);
    expect(uploads).toEqual([]);
  });

  test("an avatar is restored after a reload until it is removed", async () => {
    const page = await open("", SMALL);
    await waitForFirstPose(page);
    // The toast appears once the file is stored.
    await waitForToast(page, "Boxes dances here", () => drop(page, "boxes.vrm", { vrm: 1, tail: true, dressed: true }));
    await expect.poll(() => textureWidths(page)).toEqual([2]);
    await page.reload();
    // Keys work only once the stage has loaded.
    await waitForFirstPose(page);
    await page.keyboard.press("KeyL");
    await page.getByRole("radio", { name: "Boxes" }).waitFor();
    await waitInEngine(page, () => globalThis.bunraku.stage.puppet?.group.getObjectByName("leftHand") !== undefined);
    expect(await limbAngleError(page)).toBeLessThan(1);
    await page.getByRole("radio", { name: "The puppet" }).check();
    await waitInEngine(page, () => globalThis.bunraku.stage.puppet?.group.getObjectByName("figure") !== undefined);
    await waitForToast(page, "Old boxes dances here", () => drop(page, "old.vrm", { vrm: 0, dressed: true }));
    await expect.poll(() => textureWidths(page)).toEqual([2]);
    expect(await limbAngleError(page)).toBeLessThan(1);
    await page.getByRole("button", { name: "Remove the avatar Old boxes" }).click();
    await page.getByRole("radio", { name: "The puppet" }).waitFor({ state: "hidden" });
    await waitInEngine(page, () => globalThis.bunraku.stage.puppet?.group.getObjectByName("figure") !== undefined);
    await expect.poll(() => storedFileCount(page)).toBe(0);
    expect(await page.evaluate(() => localStorage.getItem("bunraku.avatar"))).toBe(null);
  });

  test("an unusable avatar file is rejected with the reason", async () => {
    const page = await open("", SMALL);
    await waitForFirstPose(page);
    await drop(page, "armless.glb", { without: ["leftLowerArm", "leftHand", "leftMiddleProximal"] });
    await page.getByRole("alert").getByText("missing bones: left lower arm, left hand").waitFor();
    await dropBytes(page, "cube.glb", [1, 2, 3]);
    await page.getByRole("alert").getByText("cube.glb: Not a GLB file").waitFor();
    expect(
      await evaluateInEngine(
        page,
        () => globalThis.bunraku.stage.puppet?.group.getObjectByName("figure") !== undefined,
      ),
    ).toBe(true);
  });

  test("each performer can have its own avatar", async () => {
    const page = await open("", { ...SMALL, viewport: { width: 760, height: 560 } });
    await waitForFirstPose(page);
    await waitForWelcome(page);
    const section = page.getByRole("region", { name: "Dance as" });
    await page.keyboard.press("KeyL");
    await section.getByRole("button", { name: "Choose your own avatar" }).waitFor();
    expect(await section.getByRole("button", { name: /^Dancer/ }).count()).toBe(0);
    await page.getByRole("button", { name: "Add Sanbasō, First Steps to the stage", exact: true }).click();
    await waitForPerformers(page, 2);
    await section.getByRole("button", { name: /^Dancer 2/ }).press("Enter");
    await waitForToast(page, "mine dances here", () => drop(page, "mine.glb", MIXAMO_FIGURE));
    await waitForPerformers(page, 2);
    await pauseAtStart(page);
    expect(await puppetFlags(page)).toEqual([true, false]);
    expect(await limbAngleError(page, 1)).toBeLessThan(1);
    expect(await section.getByRole("radio", { name: "mine" }).isChecked()).toBe(true);
    expect(await findViolations(page)).toEqual([]);
    await page.keyboard.press("Escape");

    const before = await leftWrist(page, 0);
    await dragHand(page, SECOND_PERFORMER + LEFT_HAND);
    // The tag is above the controlled performer.
    const { x, width } = (await page.locator(".tag:visible", { hasText: "left hand" }).boundingBox()) ?? {
      x: NaN,
      width: NaN,
    };
    const [first, second] = await headPositions(page);
    expect(Math.abs(x + width / 2 - second)).toBeLessThan(Math.abs(x + width / 2 - first));
    // The other performer does not move, except for the correction by an upgraded block.
    expect(Math.hypot(...(await leftWrist(page, 0)).map((at, axis) => at - before[axis]))).toBeLessThan(0.06);
    await page.mouse.up();
    await waitForRelease(page, SECOND_PERFORMER + LEFT_HAND);

    // Select the first performer by key.
    await waitForToast(page, "Dancer 1 of 2", () => page.keyboard.press("KeyT"));
    await page.keyboard.press("KeyL");
    await section.getByRole("radio", { name: "mine" }).waitFor({ state: "hidden" });
    await waitForToast(page, "Boxes dances here", () => drop(page, "boxes.vrm", { vrm: 1, tail: true, dressed: true }));
    await waitForPerformers(page, 2);
    expect(await puppetFlags(page)).toEqual([false, false]);
    await section.getByRole("radio", { name: "The puppet" }).check();
    await waitInEngine(page, () => globalThis.bunraku.stage.puppet?.group.getObjectByName("figure") !== undefined);
    expect(await puppetFlags(page)).toEqual([true, false]);

    await page.reload();
    await waitForFirstPose(page);
    await waitForPerformers(page, 2);
    await waitInEngine(
      page,
      () => globalThis.bunraku.stage.performers[1]?.group.getObjectByName("figure") === undefined,
    );
    await page.keyboard.press("KeyL");
    await section.getByRole("radio", { name: "Boxes" }).waitFor();
    expect(await section.getByRole("radio", { name: "Boxes" }).isChecked()).toBe(false);
    await section.getByRole("button", { name: /^Dancer 2/ }).click();
    await section.getByRole("button", { name: "Remove the avatar mine" }).click();
    await expect.poll(() => puppetFlags(page)).toEqual([true, true]);
    await expect.poll(() => storedFileCount(page)).toBe(1);
  });
});

/** Return for each performer whether it is drawn as the puppet. */
function puppetFlags(page: Page): Promise<boolean[]> {
  return evaluateInEngine(page, () =>
    globalThis.bunraku.stage.performers.map(({ group }) => group.getObjectByName("figure") !== undefined),
  );
}

/** Return the horizontal screen positions of the performers' heads, in CSS pixels. */
function headPositions(page: Page): Promise<number[]> {
  return evaluateInEngine(page, () => globalThis.bunraku.stage.faceBoxes.map(({ left, right }) => (left + right) / 2));
}

/** Drag a left hand to a reachable point beside and below its shoulder, and wait until it arrives. */
async function dragHand(page: Page, hand: number): Promise<void> {
  const performer = hand >> 2;
  const ring = await waitUntilSettled(page, () => ringPosition(page, hand), 0.5);
  await page.mouse.move(ring.x, ring.y);
  await page.mouse.down();
  const shoulder = await nodePosition(page, "mixamorigLeftArm", performer);
  const scale =
    Math.abs(
      (await nodePosition(page, "mixamorigHead", performer)).y -
        (await nodePosition(page, "mixamorigHips", performer)).y,
    ) / 0.6;
  const to = { x: shoulder.x + 0.38 * scale, y: shoulder.y + 0.1 * scale };
  await page.mouse.move(to.x, to.y, { steps: 8 });
  await waitInEngine(page, (limb) => globalThis.bunraku.hands.source(limb) === "pointer", hand);
  await waitUntilSettled(page, () => ringPosition(page, hand), 0.3);
  await expect.poll(() => targetDistance(page, hand)).toBeLessThan(0.03);
}

/** Return the position of a performer's left wrist in world coordinates, in metres. */
function leftWrist(page: Page, performer: number): Promise<number[]> {
  return evaluateInEngine(
    page,
    (performer) => globalThis.bunraku.stage.performers[performer].joint("l_wrist").elements.slice(12, 15),
    performer,
  );
}

async function drop(page: Page, name: string, options: FigureOptions): Promise<void> {
  await dropBytes(page, name, [...createFigureFile(options)]);
}

/** Return the largest angle between a limb of an avatar and the same limb of the streamed motion, in degrees. */
async function limbAngleError(page: Page, performer = 0): Promise<number> {
  await waitForDraw(page);
  return evaluateInEngine(
    page,
    (performer) => {
      const { performers, rig } = globalThis.bunraku.stage;
      const puppet = performers[performer];
      if (!puppet) throw new Error(`No performer ${performer} on the stage`);
      const positionOf = (matrix: { elements: number[] }) => rig.group.position.clone().fromArray(matrix.elements, 12);
      const avatarNode = (...names: string[]) => {
        const found = names.map((name) => puppet.group.getObjectByName(name)).find((node) => node);
        if (!found) throw new Error(`Avatar has no node ${names.join(" or ")}`);
        return positionOf(found.matrixWorld);
      };
      const angles = (["left", "right"] as const).flatMap((side) => {
        const [mixamoPrefix, s] = [`mixamorig${side === "left" ? "Left" : "Right"}`, side[0]];
        const limbs = [
          ["UpperArm", "Arm", "shoulder"],
          ["LowerArm", "ForeArm", "elbow"],
          ["Hand", "Hand", "wrist"],
        ].concat([
          ["UpperLeg", "UpLeg", "hip"],
          ["LowerLeg", "Leg", "knee"],
          ["Foot", "Foot", "ankle"],
        ]);
        return [0, 1, 3, 4].map((k) => {
          const [a, b] = [limbs[k], limbs[k + 1]];
          const actual = avatarNode(`${side}${b[0]}`, `${mixamoPrefix}${b[1]}`)
            .sub(avatarNode(`${side}${a[0]}`, `${mixamoPrefix}${a[1]}`))
            .normalize();
          const expected = positionOf(puppet.joint(`${s}_${b[2]}`))
            .sub(positionOf(puppet.joint(`${s}_${a[2]}`)))
            .normalize();
          return Math.acos(Math.min(1, actual.dot(expected)));
        });
      });
      return (Math.max(...angles) * 180) / Math.PI;
    },
    performer,
  );
}

/** Return the number of files in the page's IndexedDB. */
function storedFileCount(page: Page): Promise<number> {
  return page.evaluate(
    () =>
      new Promise<number>((resolve, reject) => {
        const opened = indexedDB.open("bunraku");
        opened.onerror = () => reject(opened.error);
        opened.onsuccess = () => {
          const count = opened.result.transaction("files").objectStore("files").count();
          count.onsuccess = () => resolve(count.result);
        };
      }),
  );
}

/** Return the widths of the avatar's textures, in pixels. */
function textureWidths(page: Page): Promise<number[]> {
  return evaluateInEngine(page, () => {
    const found = new Set<{ width: number }>();
    globalThis.bunraku.stage.puppet?.group.traverse((object) => {
      const { material = [] } = object as unknown as { material?: object | object[] };
      for (const { map } of [material].flat() as { map?: { image: { width: number } } | null }[])
        if (map) found.add(map.image);
    });
    return [...found].map(({ width }) => width);
  });
}

/** Return the screen position of an avatar's node, in CSS pixels. */
function nodePosition(page: Page, name: string, performer: number): Promise<{ x: number; y: number }> {
  return evaluateInEngine(
    page,
    ({ name, performer }) => {
      const { stage } = globalThis.bunraku;
      const node = stage.performers[performer]?.group.getObjectByName(name);
      if (!node) throw new Error(`Avatar has no node ${name}`);
      return stage.toScreen(stage.rig.group.position.clone().fromArray(node.matrixWorld.elements, 12));
    },
    { name, performer },
  );
}

/** Return the distance of a hand from its target, in metres. */
function targetDistance(page: Page, hand: number): Promise<number> {
  return evaluateInEngine(
    page,
    (hand) => {
      const { stage, hands } = globalThis.bunraku;
      const to = hands.pullTarget(hand);
      if (!to) throw new Error("The limb has no target");
      return stage.performers[hand >> 2].handle(hand & 3, to.clone()).distanceTo(to);
    },
    hand,
  );
}
