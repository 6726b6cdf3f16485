/** Several performers on one stage: added from the library and controlled separately, also in an embedded stage. */
import type { Page } from "playwright-core";
import { expect, test } from "vitest";
import { findViolations } from "./accessibility";
import { describeInBrowser, type OpenOptions } from "./browser-suite";
import { evaluateInEngine, waitInEngine } from "./engine-probe";
import {
  LEFT_HAND,
  pauseAtStart,
  ringPosition,
  stopDrawing,
  tapKey,
  waitForDraw,
  waitForFirstPose,
  waitForHold,
  waitForPerformers,
  waitForRelease,
  waitForToast,
  waitForWelcome,
  waitUntilSettled,
} from "./page-probe";

/** With reduced motion, the session is paused when the page opens. */
const REDUCED_MOTION: OpenOptions = { viewport: { width: 900, height: 560 }, reducedMotion: "reduce" };
/** Index of the first limb of the second performer. */
const SECOND_PERFORMER = 4;

describeInBrowser("several performers", { server: "open" }, (fixture) => {
  async function open(name: string): Promise<Page> {
    const page = await fixture.open(`?name=${name}`, REDUCED_MOTION);
    await waitForFirstPose(page);
    await waitForWelcome(page);
    return page;
  }

  test("an added performer is controlled by pointer and keys, seen by others", async () => {
    const page = await open("Aiko");
    const soloCamera = await evaluateInEngine(page, () => globalThis.bunraku.stage.audience.camera.position.toArray());
    expect(await page.locator(".next-dancer:visible, .dancers:visible").count()).toBe(0);
    await page.getByRole("button", { name: "Library", exact: true }).click();
    await addToStage(page, "Sanbasō, First Steps");
    await waitForPerformers(page, 2);
    expect(await page.locator(".motion[aria-current]").innerText()).toContain("2 dancers");
    await page.getByRole("button", { name: "Close library" }).click();

    // Both are in view, and equal puppets share geometries.
    const heads = await waitUntilSettled(page, () => headRange(page), 0.01);
    expect(heads.left).toBeGreaterThan(-1);
    expect(heads.right).toBeLessThan(1);
    expect(heads.right - heads.left).toBeGreaterThan(0.5);
    expect(await evaluateInEngine(page, () => globalThis.bunraku.stage.renderer.info.memory.geometries)).toBeLessThan(
      12,
    );
    expect(await evaluateInEngine(page, () => globalThis.bunraku.stage.audience.camera.position.toArray())).not.toEqual(
      soloCamera,
    );

    const mateo = await open("Mateo");
    await waitForPerformers(mateo, 2);
    for (const viewer of [page, mateo]) {
      await pauseAtStart(viewer);
      // A blocked page would lose its limb, and the other page could claim it.
      await stopDrawing(viewer);
    }
    await page.getByRole("button", { name: "Strings", exact: true }).click();
    const second = page.getByRole("button", { name: /^Dancer 2/ });
    expect(await second.getAttribute("aria-pressed")).toBe("false");
    const ring = await waitUntilSettled(page, () => ringPosition(page, SECOND_PERFORMER + LEFT_HAND), 0.5);
    await page.mouse.move(ring.x, ring.y);
    await page.mouse.down();
    await waitForHold(page, SECOND_PERFORMER + LEFT_HAND);
    await expect.poll(() => second.getAttribute("aria-pressed")).toBe("true");
    await expect.poll(() => second.getAttribute("aria-label")).toBe("Dancer 2, left hand: You");
    const before = await leftWrists(mateo);
    await page.mouse.move(ring.x - 15, ring.y - 25, { steps: 3 });
    await page.mouse.move(ring.x - 30, ring.y - 60, { steps: 3 });
    await waitInEngine(
      mateo,
      ([x, y, z]) => {
        const at = globalThis.bunraku.stage.performers[1].joint("l_wrist").elements;
        return Math.hypot(at[12] - x, at[13] - y, at[14] - z) > 0.1;
      },
      before[1],
    );
    // Blocks of a higher level may move it by millimetres.
    const moved = (await leftWrists(mateo))[0].map((coordinate, axis) => coordinate - before[0][axis]);
    expect(Math.hypot(...moved)).toBeLessThan(0.01);
    await page.mouse.up();
    await waitForRelease(page, SECOND_PERFORMER + LEFT_HAND);

    await tapKey(page, "Digit2");
    await waitForHold(page, SECOND_PERFORMER + LEFT_HAND);
    await page.getByRole("button", { name: "Release left hand of dancer 2" }).waitFor();
    await waitForToast(mateo, "Dancer 2 of 2", () => mateo.keyboard.press("KeyT"));
    await waitForToast(mateo, "Aiko holds the left hand of dancer 2", () => tapKey(mateo, "Digit2"));
    await waitForToast(page, "Dancer 1 of 2", () => page.keyboard.press("KeyT"));
    await tapKey(page, "Digit2");
    await waitForHold(page, LEFT_HAND);
    await waitForHold(page, SECOND_PERFORMER + LEFT_HAND);
    await waitForDraw(page);
    expect(await findViolations(page)).toEqual([]);
    await page.keyboard.press("Escape");
    await waitForRelease(page, LEFT_HAND);
    await waitForRelease(page, SECOND_PERFORMER + LEFT_HAND);
  });

  test("a stage has at most four performers, also when embedded", async () => {
    const page = await open("Aiko");
    await page.getByRole("button", { name: "Library", exact: true }).click();
    await addToStage(page, "Sanbasō, First Steps");
    await waitForPerformers(page, 2);
    await addToStage(page, "Sanbasō, First Steps × 2");
    await waitForPerformers(page, 4);
    await addToStage(page, "Sanbasō, First Steps");
    await page.getByText("The stage is full").waitFor();

    const html = [
      "<!doctype html><title>Elsewhere</title>",
      `<script type="module" src="${fixture.url}/embed/bunraku-stage.js"></script>`,
      `<bunraku-stage src="${fixture.url}/?session=${fixture.session}&name=Mateo" controls`,
      ' style="width: 420px"></bunraku-stage>',
    ].join("");
    const embedding = await fixture.open(fixture.site.origin + (await fixture.publish(html)), REDUCED_MOTION);
    await embedding.waitForFunction(
      () =>
        document.querySelector("bunraku-stage")?.stage?.performers.filter(({ group }) => group.visible).length === 4,
    );
    await embedding.getByRole("button", { name: "Dancer 1 of 4: go to the next" }).click();
    await embedding.waitForFunction(() => document.querySelector("bunraku-stage")?.puppeteer?.id);
    await embedding.getByRole("button", { name: "Take the right leg of dancer 2" }).click();
    await waitInEngine(page, (limb) => globalThis.bunraku.viewer.presence?.limbs[limb] !== null, SECOND_PERFORMER + 3);
  });
});

/** Add the motion of this name to the stage. The library may have several of them, from other tests. */
async function addToStage(page: Page, name: string): Promise<void> {
  await page
    .getByRole("button", { name: `Add ${name} to the stage`, exact: true })
    .first()
    .click();
}

/** Return the horizontal range of the heads in normalised device coordinates (-1 to 1). */
function headRange(page: Page): Promise<{ left: number; right: number }> {
  return evaluateInEngine(page, () => {
    const { stage } = globalThis.bunraku;
    const at = stage.performers.map(
      (performer) =>
        stage.rig.group.position
          .clone()
          .setFromMatrixPosition(performer.joint("skullbase"))
          .project(stage.audience.camera).x,
    );
    return { left: Math.min(...at), right: Math.max(...at) };
  });
}

/** Return the positions of all performers' left wrists in world coordinates, in metres. */
function leftWrists(page: Page): Promise<[number, number, number][]> {
  return evaluateInEngine(page, () =>
    globalThis.bunraku.stage.performers.map((performer) => {
      const at = performer.joint("l_wrist").elements;
      return [at[12], at[13], at[14]] as [number, number, number];
    }),
  );
}
