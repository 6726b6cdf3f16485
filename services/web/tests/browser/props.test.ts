/** Props: added by the panel, put into hands, passed to another performer, laid down and seen by others. */
import type { Page } from "playwright-core";
import { expect, test } from "vitest";
import { findViolations } from "./accessibility";
import { describeInBrowser, type OpenOptions } from "./browser-suite";
import { evaluateInEngine, waitInEngine } from "./engine-probe";
import { downloadNodeNames } from "./glb-download";
import {
  pauseAtStart,
  stopDrawing,
  tapKey,
  waitForDraw,
  waitForFirstPose,
  waitForHold,
  waitForPerformers,
  waitForRelease,
  waitForToast,
  waitForWelcome,
} from "./page-probe";

/** Nothing eases, and the session is paused. */
const REDUCED_MOTION: OpenOptions = { viewport: { width: 900, height: 700 }, reducedMotion: "reduce" };
const RIGHT_HAND = 1;
const LEFT_HAND_OF_SECOND = 4;
/** Distance at which a prop is in a hand, in metres. */
const TOUCH_M = 1e-3;

describeInBrowser("props", { server: "open" }, (fixture) => {
  async function open(name: string, options = REDUCED_MOTION): Promise<Page> {
    const page = await fixture.open(`?name=${name}`, options);
    await waitForFirstPose(page);
    await waitForWelcome(page);
    return page;
  }

  test("a fan is put into a hand, passed to the second performer and laid down, as others see it", async () => {
    const aiko = await open("Aiko");
    await aiko.getByRole("button", { name: "Library", exact: true }).click();
    await aiko.getByRole("button", { name: "Add Sanbasō, First Steps to the stage", exact: true }).first().click();
    await waitForPerformers(aiko, 2);
    await aiko.getByRole("button", { name: "Close library" }).click();
    const mateo = await open("Mateo");
    await waitForPerformers(mateo, 2);
    for (const page of [aiko, mateo]) {
      await pauseAtStart(page);
      // A blocked page would lose its limb.
      await stopDrawing(page);
    }
    await openProps(aiko);
    await aiko.getByRole("button", { name: "Add: Fan" }).click();
    const place = aiko.getByRole("combobox", { name: "Where it is: Fan" });
    await place.waitFor();
    for (const page of [aiko, mateo]) {
      await waitInEngine(page, () => globalThis.bunraku.stage.scene.getObjectByName("fan") !== undefined);
      expect(await distanceToHand(page, RIGHT_HAND)).toBeGreaterThan(0.3);
    }

    await place.selectOption("Right hand of dancer 1");
    for (const page of [aiko, mateo]) await waitForHand(page, RIGHT_HAND);
    // It follows the hand that is pulled.
    const before = await handHeight(mateo);
    await tapKey(aiko, "Digit1");
    await waitForHold(aiko, RIGHT_HAND);
    await aiko.keyboard.down("KeyW");
    await waitInEngine(
      mateo,
      (before) => {
        const { stage } = globalThis.bunraku;
        return Math.abs(stage.performers[0].joint("r_wrist").elements[13] - before) > 0.1;
      },
      before,
    );
    await aiko.keyboard.up("KeyW");
    for (const page of [aiko, mateo]) expect(await distanceToHand(page, RIGHT_HAND)).toBeLessThan(TOUCH_M);

    // Another puppeteer cannot take it from the held hand.
    await openProps(mateo);
    const choice = mateo.getByRole("combobox", { name: "Where it is: Fan" });
    await waitForToast(mateo, "Someone else holds the hand with this prop", () =>
      choice.selectOption("Left hand of dancer 1"),
    );
    await expect.poll(() => choice.inputValue()).toBe(String(RIGHT_HAND));

    await place.selectOption("Left hand of dancer 2");
    for (const page of [aiko, mateo]) await waitForHand(page, LEFT_HAND_OF_SECOND);
    await expect.poll(() => choice.inputValue()).toBe(String(LEFT_HAND_OF_SECOND));

    const late = await open("Late");
    await waitForHand(late, LEFT_HAND_OF_SECOND);

    // The key takes a near prop from a hand that nobody holds, and lays it down.
    await waitForToast(mateo, "Bring a hand that you hold near a prop", () => mateo.keyboard.press("KeyF"));
    await mateo.keyboard.press("KeyT");
    await tapKey(mateo, "Digit2");
    await waitForHold(mateo, LEFT_HAND_OF_SECOND);
    await mateo.keyboard.press("KeyF");
    for (const page of [aiko, mateo, late]) await waitInEngine(page, isBeforeSecond);
    await mateo.keyboard.press("Escape");
    await waitForRelease(mateo, LEFT_HAND_OF_SECOND);
    await choice.selectOption("Left hand of dancer 2");
    await waitForHand(late, LEFT_HAND_OF_SECOND);

    await choice.selectOption("On the floor");
    for (const page of [aiko, mateo, late]) await waitInEngine(page, isBeforeSecond);

    await aiko.getByRole("button", { name: "Remove: Fan" }).click();
    for (const page of [aiko, mateo, late])
      await waitInEngine(page, () => globalThis.bunraku.stage.scene.getObjectByName("fan") === undefined);
    await place.waitFor({ state: "detached" });
    // The focus stays in the section.
    expect(await aiko.evaluate(() => document.activeElement?.tagName)).toBe("SUMMARY");
  });

  test("eight props have room, two of a kind have numbers, and a hand has one", async () => {
    const page = await open("Aiko");
    await stopDrawing(page);
    await openProps(page);
    const names = ["Fan", "Umbrella", "Ball", "Plum branch"];
    for (let prop = 0; prop < 8; prop++) {
      await page.getByRole("button", { name: `Add: ${names[prop % 4]}` }).click();
      await expect.poll(() => page.locator(".prop-list li").count()).toBe(prop + 1);
    }
    await page.getByText("There is room for 8 props").waitFor();
    expect(await page.getByRole("button", { name: "Add: Ball" }).isDisabled()).toBe(true);
    await page.getByRole("combobox", { name: "Where it is: Ball 2" }).selectOption("Left hand");
    const taken = page
      .getByRole("combobox", { name: "Where it is: Ball 1" })
      .getByRole("option", { name: "Left hand" });
    await expect.poll(() => taken.isDisabled()).toBe(true);
    const kinds = await evaluateInEngine(page, () =>
      (globalThis.bunraku.stage.scene.getObjectByName("props")?.children ?? []).map(({ name }) => name).join(),
    );
    expect(kinds).toBe("fan,umbrella,ball,branch,fan,umbrella,ball,branch");
    await page.getByRole("button", { name: "Remove: Fan 1" }).click();
    await page.getByRole("combobox", { name: "Where it is: Fan", exact: true }).waitFor();
  });

  test("a prop that is taken moves there in steps, and the stage is still afterwards", async () => {
    const page = await open("Aiko", { viewport: REDUCED_MOTION.viewport ?? null });
    await pauseAtStart(page);
    await fixture.request("PATCH", `/v1/sessions/${fixture.session}`, { props: { "0": "ball" } });
    await waitInEngine(page, () => globalThis.bunraku.stage.scene.getObjectByName("ball") !== undefined);
    /** Record the largest step of the ball between two updates of the stage, and the whole way. */
    await evaluateInEngine(page, () => {
      const { stage } = globalThis.bunraku;
      const ball = stage.scene.getObjectByName("ball");
      const draw = stage.draw.bind(stage);
      const way = { longest: 0, steps: 0, total: 0 };
      Object.assign(globalThis, { way });
      stage.draw = (...frame) => {
        const before = ball?.matrix.clone();
        draw(...frame);
        if (!ball || !before) return;
        const [a, b] = [before.elements, ball.matrix.elements];
        const step = Math.hypot(a[12] - b[12], a[13] - b[13], a[14] - b[14]);
        way.longest = Math.max(way.longest, step);
        way.total += step;
        if (step > 1e-6) way.steps++;
      };
    });
    await openProps(page);
    await page.getByRole("combobox", { name: "Where it is: Ball" }).selectOption("Left hand");
    await waitInEngine(page, () => {
      const { viewer, stage } = globalThis.bunraku;
      return viewer.presence?.props?.[0].limb === 0 && stage.isUpToDate;
    });
    await waitForDraw(page);
    await waitInEngine(page, () => globalThis.bunraku.stage.isUpToDate);
    const { longest, steps, total } = await evaluateInEngine(
      page,
      () => (globalThis as unknown as { way: { longest: number; steps: number; total: number } }).way,
    );
    expect(total).toBeGreaterThan(0.3);
    expect(steps).toBeGreaterThan(2);
    expect(longest).toBeLessThan(0.9 * total);
  });

  test("a recording shows its props, and its GLB file has them", async () => {
    const page = await open("Aiko");
    await stopDrawing(page);
    await fixture.request("PATCH", `/v1/sessions/${fixture.session}`, { props: { "0": "fan" }, playing: true });
    await waitInEngine(page, () => {
      const { puppeteer, viewer } = globalThis.bunraku;
      if (viewer.presence?.props?.[0]?.limb === 1) return true;
      puppeteer.put(0, 1);
      return false;
    });
    // The last second has the fan in the hand.
    const after = await evaluateInEngine(page, () => globalThis.bunraku.viewer.clockTime(performance.now()) ?? 0);
    await waitInEngine(
      page,
      (after) => (globalThis.bunraku.viewer.clockTime(performance.now()) ?? 0) > after + 2e6,
      after,
    );
    const { id } = await fixture.request<{ id: string }>("POST", `/v1/sessions/${fixture.session}/recordings`, {
      name: "With a fan",
      seconds: 2,
    });
    const recorded = await fixture.open(`/?motion=${id}&name=Mateo`, REDUCED_MOTION);
    await waitForFirstPose(recorded);
    await recorded.keyboard.press("ArrowRight");
    await waitForHand(recorded, RIGHT_HAND);
    expect(await downloadNodeNames(recorded, "With a fan")).toContain("prop 1 fan");
  });

  test.each([
    ["a desktop", { width: 1280, height: 800 }, false],
    ["a phone", { width: 390, height: 844 }, true],
  ] as const)("the section is accessible on %s", async (_, viewport, hasTouch) => {
    const page = await open("Aiko", { viewport, hasTouch, reducedMotion: "reduce" });
    await fixture.request("PATCH", `/v1/sessions/${fixture.session}`, { props: { "0": "fan", "1": "umbrella" } });
    await openProps(page);
    await page.getByRole("combobox", { name: "Where it is: Fan" }).waitFor();
    for (const colorScheme of ["dark", "light"] as const) {
      await page.emulateMedia({ colorScheme, reducedMotion: "reduce" });
      await waitForDraw(page);
      expect(await findViolations(page), colorScheme).toEqual([]);
    }
    if (!hasTouch) return;
    const sizes = await page
      .locator(".props :is(summary, select, button)")
      .evaluateAll((controls) => controls.map((control) => control.getBoundingClientRect().height));
    expect(Math.min(...sizes)).toBeGreaterThanOrEqual(44);
  });
});

async function openProps(page: Page): Promise<void> {
  await page.getByRole("button", { name: "Strings", exact: true }).click();
  await page.locator(".props summary").click();
}

/** Return the distance of the fan from the grip of a hand, in metres. */
function distanceToHand(page: Page, limb: number): Promise<number> {
  return evaluateInEngine(page, fanDistance, limb);
}

async function waitForHand(page: Page, limb: number): Promise<void> {
  await waitInEngine(page, fanIsInHand, [limb, TOUCH_M] as const);
}

function fanDistance(limb: number): number {
  const { stage } = globalThis.bunraku;
  const fan = stage.scene.getObjectByName("fan");
  const hand = stage.performers[Math.floor(limb / 4)].hand(limb % 4, 0.5, stage.rig.group.matrix.clone());
  if (!fan?.visible) return Infinity;
  const [a, b] = [fan.matrixWorld.elements, hand.elements];
  return Math.hypot(a[12] - b[12], a[13] - b[13], a[14] - b[14]);
}

function fanIsInHand([limb, touch]: readonly [number, number]): boolean {
  const { stage } = globalThis.bunraku;
  const fan = stage.scene.getObjectByName("fan");
  if (!fan?.visible) return false;
  const hand = stage.performers[Math.floor(limb / 4)].hand(limb % 4, 0.5, stage.rig.group.matrix.clone());
  const [a, b] = [fan.matrixWorld.elements, hand.elements];
  return Math.hypot(a[12] - b[12], a[13] - b[13], a[14] - b[14]) < touch;
}

/** Return true if the fan lies half a metre before the second performer, on the floor. */
function isBeforeSecond(): boolean {
  const { stage } = globalThis.bunraku;
  const fan = stage.scene.getObjectByName("fan")?.matrixWorld.elements;
  const root = stage.performers[1].root.elements;
  if (!fan) return false;
  const distance = Math.hypot(fan[12] - root[12], fan[14] - root[14]);
  const height = fan[13] - stage.rig.group.position.y;
  return Math.abs(distance - 0.5) < 0.01 && height > 0 && height < 0.05;
}

/** Return the height of the first performer's right wrist, in metres. */
function handHeight(page: Page): Promise<number> {
  return evaluateInEngine(page, () => globalThis.bunraku.stage.performers[0].joint("r_wrist").elements[13]);
}
