/** One's own avatar on the page in a real browser: dropped it dances, is pulled, stays for the next visit, and leaves the browser never. */
import type { Page } from "playwright-core";
import { expect, test } from "vitest";
import { figureFile, mixamo, type FigureOptions } from "../avatar/figures";
import { describeInBrowser } from "./in-browser";
import { danced, drawn, LEFT_HAND, letGo, ringOf, settled, standAtBeginning, toasted, welcomed } from "./inside";

const SMALL = { viewport: { width: 640, height: 560 }, reducedMotion: "reduce" } as const;
/** The same figure in three kinds of file, each of other proportions than the dancer's. */
const OWN: FigureOptions = { name: mixamo, unit: 0.01, askew: true, arms: 40, forearm: 0.8, legLength: 0.85 };

describeInBrowser("one's own avatar", { demo: true }, ({ open }) => {
  test("dropped it dances in the puppet's place, is pulled by the hand, and nothing of it is sent", async () => {
    const sent: string[] = [];
    const before = async (page: Page) => {
      page.on("request", (request) => request.method() !== "GET" && sent.push(`${request.method()} ${request.url()}`));
    };
    const page = await open("", { ...SMALL, before });
    await danced(page);
    await welcomed(page);
    await standAtBeginning(page);
    sent.length = 0;
    await toasted(page, "mine dances here; everyone else sees the puppet", () => drop(page, "mine.glb", OWN));
    expect(await page.getByRole("radio", { name: "mine" }).isChecked()).toBe(true);
    await danced(page);
    expect(await page.evaluate(() => window.bunraku.stage.puppet?.group.getObjectByName("figure") === undefined)).toBe(true);
    expect(await limbsApart(page)).toBeLessThan(1);
    await page.keyboard.press("Escape");

    const ring = await settled(page, () => ringOf(page, LEFT_HAND), 0.5);
    await page.mouse.move(ring.x, ring.y);
    await page.mouse.down();
    // Beside and below the shoulder, where an arm has room.
    const shoulder = await screenOf(page, "mixamorigLeftArm");
    const scale = Math.abs((await screenOf(page, "mixamorigHead")).y - (await screenOf(page, "mixamorigHips")).y) / 0.6;
    const to = { x: shoulder.x + 0.38 * scale, y: shoulder.y + 0.1 * scale };
    await page.mouse.move(to.x, to.y, { steps: 8 });
    await page.waitForFunction((limb) => window.bunraku.hands.source(limb) === "pointer", LEFT_HAND);
    await settled(page, () => ringOf(page, LEFT_HAND), 0.3);
    await expect.poll(() => away(page)).toBeLessThan(0.03);
    await page.mouse.up();
    await letGo(page, LEFT_HAND);
    expect(sent).toEqual([]);
  });

  test("kept for the next visit; the puppet dances when it is chosen, and again when the avatar is removed", async () => {
    const page = await open("", SMALL);
    await danced(page);
    // said once it is kept
    await toasted(page, "Boxes dances here", () => drop(page, "boxes.vrm", { vrm: 1, tail: true, dressed: true }));
    expect(await pictures(page)).toEqual([2]);
    await page.reload();
    // keys are heard once the stage is there
    await danced(page);
    await page.keyboard.press("KeyL");
    await page.getByRole("radio", { name: "Boxes" }).waitFor();
    await page.waitForFunction(() => window.bunraku.stage.puppet?.group.getObjectByName("leftHand") !== undefined);
    expect(await limbsApart(page)).toBeLessThan(1);
    await page.getByRole("radio", { name: "The puppet" }).check();
    await page.waitForFunction(() => window.bunraku.stage.puppet?.group.getObjectByName("figure") !== undefined);
    await toasted(page, "Old boxes dances here", () => drop(page, "old.vrm", { vrm: 0, dressed: true }));
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
    await danced(page);
    await drop(page, "armless.glb", { without: ["leftLowerArm", "leftHand", "leftMiddleProximal"] });
    await page.getByRole("alert").getByText("these bones were not found: left lower arm, left hand").waitFor();
    await dropBytes(page, "cube.glb", [1, 2, 3]);
    await page.getByRole("alert").getByText("cube.glb: It is no GLB").waitFor();
    expect(await page.evaluate(() => window.bunraku.stage.puppet?.group.getObjectByName("figure") !== undefined)).toBe(true);
  });
});

async function drop(page: Page, name: string, options: FigureOptions): Promise<void> {
  await dropBytes(page, name, [...figureFile(options)]);
}

/** Drops a file of these bytes on the stage. */
async function dropBytes(page: Page, name: string, bytes: number[]): Promise<void> {
  await page.evaluate(({ name, bytes }) => {
    const dataTransfer = new DataTransfer();
    dataTransfer.items.add(new File([new Uint8Array(bytes)], name));
    document.querySelector("#stage")?.dispatchEvent(new DragEvent("drop", { dataTransfer, bubbles: true, cancelable: true }));
  }, { name, bytes });
}

/** The most that a limb of the avatar points elsewhere than the dancer's of the stream, degrees. */
async function limbsApart(page: Page): Promise<number> {
  await drawn(page);
  return page.evaluate(() => {
    const { puppet, rig } = window.bunraku.stage;
    if (!puppet) throw new Error("nobody dances");
    const place = (matrix: { elements: number[] }) => rig.group.position.clone().fromArray(matrix.elements, 12);
    const own = (...names: string[]) => {
      const found = names.map((name) => puppet.group.getObjectByName(name)).find((node) => node);
      if (!found) throw new Error(`no ${names.join(" or ")}`);
      return place(found.matrixWorld);
    };
    const apart = (["left", "right"] as const).flatMap((side) => {
      const [tool, s] = [`mixamorig${side === "left" ? "Left" : "Right"}`, side[0]];
      const limbs = [["UpperArm", "Arm", "shoulder"], ["LowerArm", "ForeArm", "elbow"], ["Hand", "Hand", "wrist"]].concat([["UpperLeg", "UpLeg", "hip"], ["LowerLeg", "Leg", "knee"], ["Foot", "Foot", "ankle"]]);
      return [0, 1, 3, 4].map((k) => {
        const [a, b] = [limbs[k], limbs[k + 1]];
        const mine = own(`${side}${b[0]}`, `${tool}${b[1]}`).sub(own(`${side}${a[0]}`, `${tool}${a[1]}`)).normalize();
        const told = place(puppet.joint(`${s}_${b[2]}`)).sub(place(puppet.joint(`${s}_${a[2]}`))).normalize();
        return Math.acos(Math.min(1, mine.dot(told)));
      });
    });
    return (Math.max(...apart) * 180) / Math.PI;
  });
}

/** How many files the browser keeps for the page. */
function kept(page: Page): Promise<number> {
  return page.evaluate(() => new Promise<number>((done, failed) => {
    const opened = indexedDB.open("bunraku");
    opened.onerror = () => failed(opened.error);
    opened.onsuccess = () => {
      const count = opened.result.transaction("files").objectStore("files").count();
      count.onsuccess = () => done(count.result);
    };
  }));
}

/** Widths of the pictures on the avatar, pixels. */
function pictures(page: Page): Promise<number[]> {
  return page.evaluate(() => {
    const found = new Set<{ width: number }>();
    window.bunraku.stage.puppet?.group.traverse((object) => {
      const { material = [] } = object as unknown as { material?: object | object[] };
      for (const one of [material].flat() as { map?: { image: { width: number } } | null }[]) if (one.map) found.add(one.map.image);
    });
    return [...found].map(({ width }) => width);
  });
}

/** Where a node of the avatar is on the screen, pixels. */
function screenOf(page: Page, name: string): Promise<{ x: number; y: number }> {
  return page.evaluate((name) => {
    const { stage } = window.bunraku;
    const node = stage.puppet?.group.getObjectByName(name);
    if (!node) throw new Error(`no ${name}`);
    return stage.toScreen(stage.rig.group.position.clone().fromArray(node.matrixWorld.elements, 12));
  }, name);
}

/** How far the avatar's left hand is from where it is pulled to, metres. */
function away(page: Page): Promise<number> {
  return page.evaluate((limb) => {
    const { stage, hands } = window.bunraku;
    const to = hands.pull(limb);
    if (!to || !stage.puppet) throw new Error("nothing is pulled");
    return stage.puppet.handle(limb, to.clone()).distanceTo(to);
  }, LEFT_HAND);
}
