/** One's own avatar on the page in a real browser: dropped it dances, is pulled, stays for the next visit, and leaves the browser never. */
import type { Page } from "playwright-core";
import { expect, test } from "vitest";
import { createFigureFile, type FigureOptions, mixamoName } from "../avatar/figure-files";
import { findViolations } from "./accessibility";
import { describeInBrowser } from "./browser-suite";
import {
  LEFT_HAND,
  pauseAtStart,
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
/** The first limb of the second performer: its left hand. */
const SECOND = 4;
/** The same figure in three kinds of file, each of other proportions than the dancer's. */
const OWN: FigureOptions = { name: mixamoName, unit: 0.01, askew: true, arms: 40, forearm: 0.8, legLength: 0.85 };

describeInBrowser("one's own avatar", { demo: true }, ({ open }) => {
  test("dropped it dances in the puppet's place, is pulled by the hand, and nothing of it is sent", async () => {
    const sent: string[] = [];
    const before = async (page: Page) => {
      page.on("request", (request) => request.method() !== "GET" && sent.push(`${request.method()} ${request.url()}`));
    };
    const page = await open("", { ...SMALL, before });
    await waitForFirstPose(page);
    await waitForWelcome(page);
    await pauseAtStart(page);
    sent.length = 0;
    await waitForToast(page, "mine dances here; everyone else sees the puppet", () => drop(page, "mine.glb", OWN));
    expect(await page.getByRole("radio", { name: "mine" }).isChecked()).toBe(true);
    await waitForFirstPose(page);
    expect(await page.evaluate(() => window.bunraku.stage.puppet?.group.getObjectByName("figure") === undefined)).toBe(
      true,
    );
    expect(await limbsApart(page)).toBeLessThan(1);
    await page.keyboard.press("Escape");

    await pulled(page, LEFT_HAND);
    await page.mouse.up();
    await waitForRelease(page, LEFT_HAND);
    expect(sent).toEqual([]);
  });

  test("kept for the next visit; the puppet dances when it is chosen, and again when the avatar is removed", async () => {
    const page = await open("", SMALL);
    await waitForFirstPose(page);
    // said once it is kept
    await waitForToast(page, "Boxes dances here", () => drop(page, "boxes.vrm", { vrm: 1, tail: true, dressed: true }));
    expect(await pictures(page)).toEqual([2]);
    await page.reload();
    // keys are heard once the stage is there
    await waitForFirstPose(page);
    await page.keyboard.press("KeyL");
    await page.getByRole("radio", { name: "Boxes" }).waitFor();
    await page.waitForFunction(() => window.bunraku.stage.puppet?.group.getObjectByName("leftHand") !== undefined);
    expect(await limbsApart(page)).toBeLessThan(1);
    await page.getByRole("radio", { name: "The puppet" }).check();
    await page.waitForFunction(() => window.bunraku.stage.puppet?.group.getObjectByName("figure") !== undefined);
    await waitForToast(page, "Old boxes dances here", () => drop(page, "old.vrm", { vrm: 0, dressed: true }));
    expect(await pictures(page)).toEqual([2]);
    expect(await limbsApart(page)).toBeLessThan(1);
    await page.getByRole("button", { name: "Remove the avatar Old boxes" }).click();
    await page.getByRole("radio", { name: "The puppet" }).waitFor({ state: "hidden" });
    await page.waitForFunction(() => window.bunraku.stage.puppet?.group.getObjectByName("figure") !== undefined);
    await expect.poll(() => kept(page)).toBe(0);
    expect(await page.evaluate(() => localStorage.getItem("bunraku.avatar"))).toBe(null);
  });

  test("what cannot dance says why", async () => {
    const page = await open("", SMALL);
    await waitForFirstPose(page);
    await drop(page, "armless.glb", { without: ["leftLowerArm", "leftHand", "leftMiddleProximal"] });
    await page.getByRole("alert").getByText("these bones were not found: left lower arm, left hand").waitFor();
    await dropBytes(page, "cube.glb", [1, 2, 3]);
    await page.getByRole("alert").getByText("cube.glb: Not a GLB file").waitFor();
    expect(await page.evaluate(() => window.bunraku.stage.puppet?.group.getObjectByName("figure") !== undefined)).toBe(
      true,
    );
  });

  test("of several dancers it takes the chosen one's place, is pulled there, and each may have one", async () => {
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
    await waitForToast(page, "mine dances here", () => drop(page, "mine.glb", OWN));
    await waitForPerformers(page, 2);
    await pauseAtStart(page);
    expect(await puppets(page)).toEqual([true, false]);
    expect(await limbsApart(page, 1)).toBeLessThan(1);
    expect(await section.getByRole("radio", { name: "mine" }).isChecked()).toBe(true);
    expect(await findViolations(page)).toEqual([]);
    await page.keyboard.press("Escape");

    const before = await wristOf(page, 0);
    await pulled(page, SECOND + LEFT_HAND);
    // the tag hangs over that dancer
    const { x, width } = (await page.locator(".tag:visible", { hasText: "left hand" }).boundingBox()) ?? {
      x: NaN,
      width: NaN,
    };
    const [first, second] = await heads(page);
    expect(Math.abs(x + width / 2 - second)).toBeLessThan(Math.abs(x + width / 2 - first));
    // which stands still, but for a better block that comes
    expect(Math.hypot(...(await wristOf(page, 0)).map((at, axis) => at - before[axis]))).toBeLessThan(0.06);
    await page.mouse.up();
    await waitForRelease(page, SECOND + LEFT_HAND);

    // by keyboard alone the first one's turn
    await waitForToast(page, "Dancer 1 of 2", () => page.keyboard.press("KeyT"));
    await page.keyboard.press("KeyL");
    await section.getByRole("radio", { name: "mine" }).waitFor({ state: "hidden" });
    await waitForToast(page, "Boxes dances here", () => drop(page, "boxes.vrm", { vrm: 1, tail: true, dressed: true }));
    await waitForPerformers(page, 2);
    expect(await puppets(page)).toEqual([false, false]);
    await section.getByRole("radio", { name: "The puppet" }).check();
    await page.waitForFunction(() => window.bunraku.stage.puppet?.group.getObjectByName("figure") !== undefined);
    expect(await puppets(page)).toEqual([true, false]);

    await page.reload();
    await waitForFirstPose(page);
    await waitForPerformers(page, 2);
    await page.waitForFunction(() => window.bunraku.stage.performers[1]?.group.getObjectByName("figure") === undefined);
    await page.keyboard.press("KeyL");
    await section.getByRole("radio", { name: "Boxes" }).waitFor();
    expect(await section.getByRole("radio", { name: "Boxes" }).isChecked()).toBe(false);
    await section.getByRole("button", { name: /^Dancer 2/ }).click();
    await section.getByRole("button", { name: "Remove the avatar mine" }).click();
    await expect.poll(() => puppets(page)).toEqual([true, true]);
    await expect.poll(() => kept(page)).toBe(1);
  });
});

/** Of each dancer, whether the puppet dances. */
function puppets(page: Page): Promise<boolean[]> {
  return page.evaluate(() =>
    window.bunraku.stage.performers.map(({ group }) => group.getObjectByName("figure") !== undefined),
  );
}

/** How far from the left the dancers' heads are on the screen, pixels. */
function heads(page: Page): Promise<number[]> {
  return page.evaluate(() => window.bunraku.stage.faceBoxes.map(({ left, right }) => (left + right) / 2));
}

/** Drags a left hand beside and below its shoulder, where an arm has room, and waits until it is there. */
async function pulled(page: Page, hand: number): Promise<void> {
  const performer = hand >> 2;
  const ring = await waitUntilSettled(page, () => ringPosition(page, hand), 0.5);
  await page.mouse.move(ring.x, ring.y);
  await page.mouse.down();
  const shoulder = await screenOf(page, "mixamorigLeftArm", performer);
  const scale =
    Math.abs(
      (await screenOf(page, "mixamorigHead", performer)).y - (await screenOf(page, "mixamorigHips", performer)).y,
    ) / 0.6;
  const to = { x: shoulder.x + 0.38 * scale, y: shoulder.y + 0.1 * scale };
  await page.mouse.move(to.x, to.y, { steps: 8 });
  await page.waitForFunction((limb) => window.bunraku.hands.source(limb) === "pointer", hand);
  await waitUntilSettled(page, () => ringPosition(page, hand), 0.3);
  await expect.poll(() => away(page, hand)).toBeLessThan(0.03);
}

/** World place of a dancer's left wrist. */
function wristOf(page: Page, performer: number): Promise<number[]> {
  return page.evaluate(
    (performer) => window.bunraku.stage.performers[performer].joint("l_wrist").elements.slice(12, 15),
    performer,
  );
}

async function drop(page: Page, name: string, options: FigureOptions): Promise<void> {
  await dropBytes(page, name, [...createFigureFile(options)]);
}

/** Drops a file of these bytes on the stage. */
async function dropBytes(page: Page, name: string, bytes: number[]): Promise<void> {
  await page.evaluate(
    ({ name, bytes }) => {
      const dataTransfer = new DataTransfer();
      dataTransfer.items.add(new File([new Uint8Array(bytes)], name));
      document
        .querySelector("#stage")
        ?.dispatchEvent(new DragEvent("drop", { dataTransfer, bubbles: true, cancelable: true }));
    },
    { name, bytes },
  );
}

/** The most that a limb of an avatar points elsewhere than the dancer's of the stream, degrees. */
async function limbsApart(page: Page, performer = 0): Promise<number> {
  await waitForDraw(page);
  return page.evaluate((performer) => {
    const { performers, rig } = window.bunraku.stage;
    const puppet = performers[performer];
    if (!puppet) throw new Error("nobody dances");
    const place = (matrix: { elements: number[] }) => rig.group.position.clone().fromArray(matrix.elements, 12);
    const own = (...names: string[]) => {
      const found = names.map((name) => puppet.group.getObjectByName(name)).find((node) => node);
      if (!found) throw new Error(`no ${names.join(" or ")}`);
      return place(found.matrixWorld);
    };
    const apart = (["left", "right"] as const).flatMap((side) => {
      const [tool, s] = [`mixamorig${side === "left" ? "Left" : "Right"}`, side[0]];
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
        const mine = own(`${side}${b[0]}`, `${tool}${b[1]}`)
          .sub(own(`${side}${a[0]}`, `${tool}${a[1]}`))
          .normalize();
        const told = place(puppet.joint(`${s}_${b[2]}`))
          .sub(place(puppet.joint(`${s}_${a[2]}`)))
          .normalize();
        return Math.acos(Math.min(1, mine.dot(told)));
      });
    });
    return (Math.max(...apart) * 180) / Math.PI;
  }, performer);
}

/** How many files the browser keeps for the page. */
function kept(page: Page): Promise<number> {
  return page.evaluate(
    () =>
      new Promise<number>((done, failed) => {
        const opened = indexedDB.open("bunraku");
        opened.onerror = () => failed(opened.error);
        opened.onsuccess = () => {
          const count = opened.result.transaction("files").objectStore("files").count();
          count.onsuccess = () => done(count.result);
        };
      }),
  );
}

/** Widths of the pictures on the avatar, pixels. */
function pictures(page: Page): Promise<number[]> {
  return page.evaluate(() => {
    const found = new Set<{ width: number }>();
    window.bunraku.stage.puppet?.group.traverse((object) => {
      const { material = [] } = object as unknown as { material?: object | object[] };
      for (const one of [material].flat() as { map?: { image: { width: number } } | null }[])
        if (one.map) found.add(one.map.image);
    });
    return [...found].map(({ width }) => width);
  });
}

/** Where a node of an avatar is on the screen, pixels. */
function screenOf(page: Page, name: string, performer: number): Promise<{ x: number; y: number }> {
  return page.evaluate(
    ({ name, performer }) => {
      const { stage } = window.bunraku;
      const node = stage.performers[performer]?.group.getObjectByName(name);
      if (!node) throw new Error(`no ${name}`);
      return stage.toScreen(stage.rig.group.position.clone().fromArray(node.matrixWorld.elements, 12));
    },
    { name, performer },
  );
}

/** How far a hand is from where it is pulled to, metres, by the limb's number. */
function away(page: Page, hand: number): Promise<number> {
  return page.evaluate((hand) => {
    const { stage, hands } = window.bunraku;
    const to = hands.pullTarget(hand);
    if (!to) throw new Error("nothing is pulled");
    return stage.performers[hand >> 2].handle(hand & 3, to.clone()).distanceTo(to);
  }, hand);
}
