/** Live performers: shown, named, controlled by the page, and gone again; and the guide for those who become one. */
import type { Page } from "playwright-core";
import { expect, onTestFinished, test } from "vitest";
import { Access } from "../../src/client/access";
import { Performer } from "../../src/client/performer";
import { fromRotationVector } from "../../src/motion/rotation";
import { JOINTS } from "../../src/motion/skeleton";
import { findViolations } from "./accessibility";
import { describeInBrowser } from "./browser-suite";
import { createEmbeddingPage } from "./embedding-page";
import { evaluateInEngine, waitInEngine } from "./engine-probe";
import { danceAt, startPerformer } from "./live-performer";
import {
  LEFT_HAND,
  waitForFirstPose,
  waitForHold,
  waitForPerformers,
  waitForRelease,
  waitForWelcome,
  waitUntilSettled,
} from "./page-probe";

/** Index of the first limb of the second performer. */
const SECOND_PERFORMER = 4;
const MAX_LAG_S = 1;
const LAG_STEP_S = 0.005;
/** A mean error of 1 mm leaves this much in the angle of a joint with a short lever. */
const MAX_ANGLE_RAD = 0.06;

/** Return the clock time in seconds and the local rotation vectors (54) of the second performer, as it is shown. */
function shownPose(page: Page): Promise<{ clock: number; vectors: number[] } | null> {
  return evaluateInEngine(page, () => {
    const { viewer } = globalThis.bunraku;
    const now = performance.now();
    const pose = viewer.poseAt(now, 1);
    if (!pose) return null;
    const vectors: number[] = [];
    for (let at = 0; at < 72; at += 4) {
      const [w, x, y, z] = pose.rotations.subarray(at, at + 4);
      const sine = Math.hypot(x, y, z);
      const scale = sine < 1e-9 ? 2 : (2 * Math.atan2(Math.sign(w) * sine, Math.abs(w))) / sine;
      vectors.push(x * scale, y * scale, z * scale);
    }
    return { clock: viewer.presentationTime(now) / 1e6, vectors };
  });
}

/** Return the largest angle, in radians, between a shown pose and the dance at the instant before it that fits best. */
function deviation({ clock, vectors }: { clock: number; vectors: number[] }): number {
  let best = Infinity;
  for (let lag = 0; lag <= MAX_LAG_S; lag += LAG_STEP_S) {
    const expected = danceAt(clock - lag).vectors;
    best = Math.min(best, Math.max(...vectors.map((value, i) => Math.abs(value - expected[i]))));
  }
  return best;
}

/** Return the position of the second performer's joint in world coordinates, in metres. */
function jointOfSecond(page: Page, joint: string): Promise<[number, number, number]> {
  return evaluateInEngine(
    page,
    (joint) => {
      const at = globalThis.bunraku.stage.performers[1].joint(joint).elements;
      return [at[12], at[13], at[14]] as [number, number, number];
    },
    joint,
  );
}

describeInBrowser("live performers", { server: "open" }, (fixture) => {
  test("a live performer is seen, named, controlled, and leaves", async () => {
    const page = await fixture.open("?name=Aiko", { viewport: { width: 900, height: 560 }, reducedMotion: "reduce" });
    await waitForFirstPose(page);
    await waitForWelcome(page);
    expect(await page.locator(".live").isVisible()).toBe(false);
    const piece = page.locator(".brand-piece");
    const name = await piece.innerText();
    expect(name).not.toBe("");

    const performer = await startPerformer(fixture, "Ben", [1, 0, 0]);
    expect(performer.performer).toBe(1);
    await waitForPerformers(page, 2);
    const badge = page.locator(".live");
    await badge.waitFor();
    expect(await badge.innerText()).toMatch(/^Live\s+Ben$/);
    await expect.poll(() => piece.innerText()).toBe(name);
    // The session is paused; the performer moves as it dances.
    const moving = await jointOfSecond(page, "l_wrist");
    await waitInEngine(
      page,
      ([x, y, z]) => {
        const at = globalThis.bunraku.stage.performers[1].joint("l_wrist").elements;
        return Math.hypot(at[12] - x, at[13] - y, at[14] - z) > 0.1;
      },
      moving,
    );
    await expect.poll(async () => deviation((await shownPose(page))!)).toBeLessThan(MAX_ANGLE_RAD);
    await page.getByRole("button", { name: "Connection" }).click();
    await page.getByText(/^Live: \d+ ms after the movement$/).waitFor();
    await page.getByRole("button", { name: "Close connection" }).click();

    performer.standAt(0);
    await waitUntilSettled(page, () => jointOfSecond(page, "l_wrist"), 0.003);
    // A busy machine may send no samples for a while; the performer then goes to its rest pose and comes back.
    const distance = (vectors: number[]) => Math.max(...vectors.map((value, i) => Math.abs(value - dance[i])));
    const dance = danceAt(0).vectors;
    await expect.poll(async () => distance((await shownPose(page))!.vectors)).toBeLessThan(MAX_ANGLE_RAD);
    const still = await jointOfSecond(page, "l_wrist");
    await page.keyboard.press("KeyT");
    await page.keyboard.press("Digit2");
    await waitForHold(page, SECOND_PERFORMER + LEFT_HAND);
    await page.keyboard.down("ArrowUp");
    await waitInEngine(
      page,
      ([x, y, z]) => {
        const at = globalThis.bunraku.stage.performers[1].joint("l_wrist").elements;
        return Math.hypot(at[12] - x, at[13] - y, at[14] - z) > 0.1;
      },
      still,
    );
    await page.keyboard.up("ArrowUp");
    // The other joints are still the performer's.
    const isFree = (index: number) => index < 12 * 3 || index >= 15 * 3;
    await expect
      .poll(async () => distance((await shownPose(page))!.vectors.map((value, i) => (isFree(i) ? value : dance[i]))))
      .toBeLessThan(MAX_ANGLE_RAD);
    await page.keyboard.press("Escape");
    await waitForRelease(page, SECOND_PERFORMER + LEFT_HAND);
    await waitInEngine(
      page,
      ([x, y, z]) => {
        const at = globalThis.bunraku.stage.performers[1].joint("l_wrist").elements;
        return Math.hypot(at[12] - x, at[13] - y, at[14] - z) < 0.01;
      },
      still,
    );
    expect(await findViolations(page)).toEqual([]);

    await performer.end();
    await badge.waitFor({ state: "hidden" });
    await waitForPerformers(page, 1);
    expect(await evaluateInEngine(page, () => globalThis.bunraku.viewer.damagedCount)).toBe(0);
  });

  test("an embedded stage shows a live performer, also one who was there before", async () => {
    const performer = await startPerformer(fixture, "Ben", [1, 0, 0]);
    const stage = `<bunraku-stage src="${fixture.url}/?session=${fixture.session}" style="width: 420px"></bunraku-stage>`;
    const html = createEmbeddingPage(stage, fixture.url);
    const page = await fixture.open(fixture.site.origin + (await fixture.publish(html)));
    await page.waitForFunction(() => {
      const { viewer, stage } = document.querySelector("bunraku-stage")!;
      const [live] = viewer?.presence?.live ?? [];
      const pose = viewer?.poseAt(performance.now(), 1);
      // the left shoulder of the dance, which at rest hangs down
      return live?.name === "Ben" && stage?.performers[1]?.group.visible && pose && pose.rotations[12 * 4] < 0.98;
    });
    await performer.end();
    await page.waitForFunction(() => {
      const { viewer, stage } = document.querySelector("bunraku-stage")!;
      return viewer?.presence?.live === null && stage?.performers.length === 1;
    });
  });

  test("the performer of the package is seen, reconnects, and leaves a motion", async () => {
    const page = await fixture.open("", { reducedMotion: "reduce" });
    await waitForFirstPose(page);
    const proxy = await fixture.proxy();
    const performer = await Performer.open({
      access: new Access(proxy.url),
      name: "Chie",
      session: fixture.session!,
      place: [1, 0, 0],
    });
    const rotations = new Float64Array(4 * JOINTS.length);
    const timer = setInterval(() => {
      const now = performance.now();
      const { root, vectors } = danceAt((performance.timeOrigin + now) / 1000);
      for (let joint = 0; joint < JOINTS.length; joint++) {
        const [x, y, z] = vectors.subarray(3 * joint);
        fromRotationVector(rotations, 4 * joint, x, y, z);
      }
      performer.frame(root, rotations, now);
    }, 1000 / 60);
    onTestFinished(() => clearInterval(timer));
    await waitForPerformers(page, 2);
    await page.locator(".live").getByText("Chie").waitFor();
    await expect.poll(async () => deviation((await shownPose(page))!)).toBeLessThan(MAX_ANGLE_RAD);

    const opened = new Promise((resolve) => performer.addEventListener("open", resolve, { once: true }));
    proxy.cutWebSockets(/performers/);
    await opened;
    await expect.poll(async () => deviation((await shownPose(page))!)).toBeLessThan(MAX_ANGLE_RAD);

    await performer.close();
    await waitForPerformers(page, 1);
    await expect
      .poll(async () => {
        const { items } = await fixture.request<{ items: { id: string }[] }>("GET", "/v1/motions");
        return items.map(({ id }) => id);
      })
      .toContain(performer.motion);
  });

  test("the guide has the command for this session", async () => {
    const page = await fixture.open();
    await waitForFirstPose(page);
    await page.getByRole("button", { name: "Library", exact: true }).click();
    const toggle = page.getByRole("button", { name: "Become a performer" });
    expect(await toggle.getAttribute("aria-expanded")).toBe("false");
    await toggle.click();
    const steps = page.locator(".steps");
    await steps.waitFor();
    expect(await steps.locator("li").count()).toBe(3);
    expect(await steps.locator("code").allInnerTexts()).toEqual([
      `bunraku capture vmc --server ${fixture.url} --session ${fixture.session}`,
    ]);
    expect(await steps.innerText()).toContain("port 39539");
    expect(await findViolations(page)).toEqual([]);
    await toggle.click();
    expect(await steps.isVisible()).toBe(false);
  });
});

describeInBrowser("guide with access control", { server: "guarded" }, (fixture) => {
  test("it names the token, for those who may perform", async () => {
    const page = await fixture.open(`/#token=${fixture.tokens?.admin}`);
    await waitForFirstPose(page);
    await page.getByRole("button", { name: "Library", exact: true }).click();
    await page.getByRole("button", { name: "Become a performer" }).click();
    await page.locator(".steps").waitFor();
    const [first, second] = await page.locator(".steps code").allInnerTexts();
    expect(first).toBe("bunraku token --role ingest");
    expect(second).toMatch(/ --token TOKEN$/);

    const puppeteer = await fixture.open(`/#token=${fixture.tokens?.control}`);
    await waitForFirstPose(puppeteer);
    await puppeteer.getByRole("button", { name: "Library", exact: true }).click();
    await puppeteer.getByRole("complementary", { name: "Library" }).waitFor();
    expect(await puppeteer.getByRole("button", { name: "Become a performer" }).count()).toBe(0);
  });
});
