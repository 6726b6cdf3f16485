/** `<bunraku-stage>` in plain HTML pages of another site. */
import { mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import type { Page, WebSocket } from "playwright-core";
import { beforeEach, expect, onTestFinished, test } from "vitest";
import type { BunrakuStage } from "../../src/element/stage-element";
import { describeInBrowser, type OpenOptions } from "./browser-suite";
import { createEmbeddingPage, waitForStages } from "./embedding-page";
import { LEFT_HAND, tapKey, waitUntilSettled } from "./page-probe";

describeInBrowser("embedded stage", { server: "guarded" }, (fixture) => {
  /** Token of role control. */
  let token: string;
  let session: string;
  /** Address of the test's session. */
  let address: string;

  beforeEach(() => {
    [token, session] = [fixture.tokens?.control ?? "", fixture.session ?? ""];
    address = `${fixture.url}/?session=${session}#token=${token}`;
  });

  /** Open a page of the foreign site with `stages` in it. */
  async function open(stages: string, options: OpenOptions = {}, origin = fixture.site.origin): Promise<Page> {
    return fixture.open(origin + (await fixture.publish(createEmbeddingPage(stages, fixture.url))), options);
  }

  test("one script tag embeds a stage controlled by pointer and keys", async () => {
    const page = await open(
      `<bunraku-stage src="${fixture.url}/?session=${session}&name=Aiko#token=${token}" controls` +
        ' style="width: 420px; margin: 30px"></bunraku-stage>',
    );
    await waitForStages(page);
    await page.getByRole("button", { name: "Pause" }).click();
    await page.getByRole("button", { name: "Play", exact: true }).waitFor();
    await page.waitForFunction(() => document.querySelector("bunraku-stage")?.puppeteer?.id);
    // At position 0 the hands hang down and can be moved upwards.
    await fixture.request("PATCH", `/v1/sessions/${session}`, { playing: false, position: 0 });
    await page.waitForFunction(() => {
      const viewer = document.querySelector("bunraku-stage")!.viewer!;
      const timeline = viewer.timelineHistory.at(viewer.presentationTime(performance.now()));
      return timeline !== null && !timeline.playing && timeline.position === 0 && viewer.blocks[0] >= 0;
    });
    const ring = await waitUntilSettled(page, () => leftHandRing(page), 0.5);
    await page.mouse.move(ring.x, ring.y);
    await page.mouse.down();
    await page.getByRole("button", { name: "Release the left hand" }).waitFor();
    await page.mouse.move(ring.x + 10, ring.y - 20, { steps: 3 });
    await page.mouse.move(ring.x + 20, ring.y - 45, { steps: 3 });
    await page.waitForFunction(({ limb }) => document.querySelector("bunraku-stage")?.puppeteer?.holds(limb), {
      limb: LEFT_HAND,
    });
    // The ring follows the pointer, wherever the stage is in the page.
    const target = [ring.x + 20, ring.y - 45];
    const ringError = async () => ({
      pixels: Math.hypot(...Object.values(await leftHandRing(page)).map((at, axis) => at - target[axis])),
    });
    expect((await waitUntilSettled(page, ringError, 0.5)).pixels).toBeLessThan(12);
    expect(await page.locator(".tag:visible").innerText()).toContain("You");
    await page.mouse.up();
    await page.getByRole("button", { name: "Take the left hand" }).waitFor();
    // The stage receives keys only while it has the focus.
    await tapKey(page, "Digit2");
    await page.getByRole("button", { name: "Release the left hand" }).waitFor();
    await page.keyboard.press("Escape");
    await page.getByRole("button", { name: "Take the left hand" }).waitFor();
    await page.keyboard.press("Space");
    await page.getByRole("button", { name: "Pause" }).waitFor();
    await page.evaluate(() => (document.activeElement as HTMLElement).blur());
    await tapKey(page, "Digit2");
    expect(
      await page.evaluate((limb) => document.querySelector("bunraku-stage")?.puppeteer?.holds(limb), LEFT_HAND),
    ).toBe(false);
  });

  test("buttons of limbs wait for the stage, and stay in their places", async () => {
    let want: () => void = () => undefined;
    const isWanted = new Promise<void>((resolve) => (want = resolve));
    const page = await open(`<bunraku-stage src="${address}" controls style="width: 300px"></bunraku-stage>`, {
      before: (page) =>
        page.route(/stage-chunk/, async (route) => {
          await isWanted;
          await route.continue();
        }),
    });
    await page.waitForFunction(() => document.querySelector("bunraku-stage")?.puppeteer?.id);
    const button = page.getByRole("button", { name: "Take the left hand" });
    const place = await button.boundingBox();
    expect(await button.isDisabled()).toBe(true);
    want();
    await waitForStages(page);
    expect(await button.boundingBox()).toEqual(place);
    await button.click();
    await page.getByRole("button", { name: "Release the left hand" }).waitFor();
  });

  test("attributes apply live; moving keeps and removing closes connections", async () => {
    const sockets: WebSocket[] = [];
    const before = async (page: Page) => void page.on("websocket", (socket) => sockets.push(socket));
    const { link } = await fixture.request<{ link: string }>("POST", "/v1/shares", { session });
    const page = await open(
      `<bunraku-stage src="${fixture.url}${link}" theme="night" style="width: 300px"></bunraku-stage><p></p>`,
      { before },
    );
    await waitForStages(page);
    const openSockets = () =>
      sockets.filter((socket) => !socket.isClosed()).map((socket) => new URL(socket.url()).pathname.split("/").at(-1));
    await expect.poll(openSockets).toEqual(["stream"]);
    expect(await page.getByRole("button").count()).toBe(0);
    const background = () => page.locator("bunraku-stage").evaluate((stage) => getComputedStyle(stage).backgroundColor);
    const night = await background();
    await page.evaluate(() => (document.querySelector("bunraku-stage")!.theme = "day"));
    expect(await background()).not.toBe(night);

    // A viewer link gives no control of limbs, whatever the page requests.
    await page.evaluate(() => (document.querySelector("bunraku-stage")!.controls = true));
    await waitForStages(page);
    // The event of the previous connection's end arrives late.
    await expect.poll(openSockets).toEqual(["stream"]);
    await expect
      .poll(() => page.getByRole("button").evaluateAll((all) => all.map((button) => button.getAttribute("title"))))
      .toEqual(["Sound on"]);
    await page.evaluate((src) => (document.querySelector("bunraku-stage")!.src = src), address);
    await page.getByRole("button", { name: "Take the left hand" }).waitFor();
    await page.waitForFunction(() => document.querySelector("bunraku-stage")?.puppeteer?.id);
    await expect.poll(() => openSockets().sort()).toEqual(["control", "stream"]);
    // Its event "ready" comes before the next frame.
    await waitForStages(page);

    // A motion without a session plays on a private timeline.
    await page.evaluate(() => {
      const readyMotions: string[] = [];
      document
        .querySelector("bunraku-stage")!
        .addEventListener("ready", () => readyMotions.push(document.querySelector("bunraku-stage")!.viewer!.motion!));
      Object.assign(window, { readyMotions });
    });
    await page.evaluate(
      (src) => (document.querySelector("bunraku-stage")!.src = src),
      `${fixture.url}/v1/motions/${fixture.motion}#token=${token}`,
    );
    await waitForStages(page);
    await page.getByRole("button", { name: "Take the left hand" }).waitFor({ state: "hidden" });
    await page.evaluate(() => {
      const stage = document.querySelector("bunraku-stage")!;
      stage.pause();
      stage.seek(12);
    });
    await page.waitForFunction(() => {
      const stage = document.querySelector("bunraku-stage")!;
      return (
        !stage.playing &&
        Math.abs(stage.position - 12) < 0.1 &&
        stage.duration > 20 &&
        stage.viewer?.motion !== null &&
        Math.abs(stage.viewer!.positionAt(performance.now()) - 12) < 0.1
      );
    });

    expect(await page.evaluate(() => (window as unknown as { readyMotions: string[] }).readyMotions)).toEqual([
      fixture.motion,
    ]);

    const isKept = await page.evaluate(() => {
      const stage = document.querySelector("bunraku-stage")!;
      const { viewer } = stage;
      document.querySelector("p")!.append(stage);
      return new Promise((done) =>
        requestAnimationFrame(() =>
          done(
            stage.viewer === viewer &&
              viewer?.isClosed === false &&
              stage.stage?.renderer.getContext().isContextLost() === false,
          ),
        ),
      );
    });
    expect(isKept).toBe(true);
    await expect.poll(openSockets).toEqual(["stream"]);
    const isReleased = await page.evaluate(() => {
      const stage = document.querySelector("bunraku-stage")!;
      const graphics = stage.stage!.renderer.getContext();
      Object.assign(window, { removedStage: stage });
      stage.remove();
      return new Promise((done) =>
        setTimeout(() =>
          done(graphics.isContextLost() && stage.viewer === null && stage.shadowRoot?.childElementCount === 0),
        ),
      );
    });
    expect(isReleased).toBe(true);
    await expect.poll(openSockets).toEqual([]);
    // The element can be inserted again.
    await page.evaluate(() => document.body.append((window as unknown as { removedStage: BunrakuStage }).removedStage));
    await waitForStages(page);
  });

  test("a page opened from a file can embed several stages", async () => {
    const folder = mkdtempSync(join(tmpdir(), "bunraku-file-"));
    onTestFinished(() => rmSync(folder, { recursive: true }));
    const file = join(folder, "page.html");
    writeFileSync(
      file,
      createEmbeddingPage(
        ["", 'theme="day"']
          .map((theme) => `<bunraku-stage src="${address}" ${theme} style="width: 200px"></bunraku-stage>`)
          .join(""),
        fixture.url,
      ),
    );
    const page = await fixture.open(pathToFileURL(file).href);
    await waitForStages(page, 2);
  });

  test("the examples page shows each example beside its source", async () => {
    const policyViolations: string[] = [];
    const before = async (page: Page) => {
      await page.exposeFunction("reportViolation", (directive: string) => void policyViolations.push(directive));
      await page.addInitScript(() =>
        document.addEventListener(
          "securitypolicyviolation",
          ({ violatedDirective }) =>
            void (window as unknown as { reportViolation(directive: string): void }).reportViolation(violatedDirective),
        ),
      );
    };
    const page = await fixture.open(`/examples#token=${token}`, { before, colorScheme: "light" });
    expect(page.url()).toBe(`${fixture.url}/examples/`);
    await page.waitForFunction(() => document.querySelector("bunraku-stage")?.stage?.puppet?.group.visible);
    expect(
      await page.locator("bunraku-stage").evaluateAll((all) => all.map((stage) => stage.getAttribute("data-shown"))),
    ).toEqual(["day", "night", "day", "day"]);
    const sources = await page.locator("pre").allInnerTexts();
    for (const html of sources.slice(0, 3)) {
      expect(html).toContain(`<script type="module" src="${fixture.url}/embed/bunraku-stage.js"></script>`);
      expect(html).toContain(`<bunraku-stage src="${fixture.url}/"`);
      expect(html).not.toMatch(/data-|=""/);
    }
    expect(sources[0]).toContain(" controls>");
    expect(sources[3]).toContain(`from "${fixture.url}/embed/bunraku.js"`);
    const canvas = page.locator("#own-camera");
    await canvas.scrollIntoViewIfNeeded();
    const first = await canvas.screenshot();
    await expect.poll(async () => first.equals(await canvas.screenshot())).toBe(false);
    await page.getByRole("button", { name: "Dark theme" }).click();
    await page.getByRole("button", { name: "Light theme" }).waitFor();
    expect(policyViolations).toEqual([]);
  });

  test("a notice explains why a stage cannot be shown", async () => {
    const notice = (page: Page, nth = 0) => page.locator("bunraku-stage .notice:not([hidden])").nth(nth);
    // An origin that the server does not allow.
    const disallowed = await open(`<bunraku-stage src="${address}"></bunraku-stage>`, {}, fixture.site.alias);
    await notice(disallowed).getByText(`BUNRAKU_ORIGINS=${fixture.site.alias}`).waitFor();
    expect(await disallowed.evaluate(() => document.querySelector("bunraku-stage")?.viewer)).toBeNull();

    const unreachable = new URL(fixture.url);
    unreachable.port = "9";
    const stageElement = (src: string) => `<bunraku-stage src="${src}" style="width: 240px"></bunraku-stage>`;
    const recordErrors = (page: Page) =>
      page.addInitScript(() => {
        Object.assign(window, { errors: [] as string[] });
        document.addEventListener(
          "error",
          (event) =>
            event instanceof CustomEvent && (window as unknown as { errors: string[] }).errors.push(event.detail),
          true,
        );
      });
    const page = await open(
      [stageElement(fixture.url), stageElement("stage:here"), stageElement(unreachable.origin)].join(""),
      { before: recordErrors },
    );
    await notice(page, 0).getByText("A link is needed").waitFor();
    await notice(page, 1).getByText("No stage here").waitFor();
    await notice(page, 2).getByText("The stage does not answer").waitFor();
    expect(await page.evaluate(() => (window as unknown as { errors: string[] }).errors.length)).toBe(3);

    // The server is unavailable at first and recovers.
    const recovering = await open(stageElement(`${fixture.url}/#token=${token}`), {
      before: (page) => page.route("**/v1/sessions", (route) => route.abort()),
    });
    await notice(recovering).getByText("Retrying automatically").waitFor();
    await recovering.unroute("**/v1/sessions");
    await waitForStages(recovering);
    await notice(recovering).waitFor({ state: "hidden" });

    const withoutWebGl = await open(stageElement(address), {
      before: (page) => page.addInitScript(() => (HTMLCanvasElement.prototype.getContext = () => null)),
    });
    await notice(withoutWebGl).getByText("This browser cannot draw the stage").waitFor();
  });
});

/** Return the position of the left hand's ring in the window, in CSS pixels. */
function leftHandRing(page: Page): Promise<{ x: number; y: number }> {
  return page.evaluate((limb) => {
    const element = document.querySelector("bunraku-stage")!;
    const stage = element.stage!;
    const { x, y } = stage.toScreen(stage.puppet!.handle(limb, stage.rig.group.position.clone()));
    const { left, top } = element.getBoundingClientRect();
    return { x: x + left, y: y + top };
  }, LEFT_HAND);
}
