/** `<bunraku-stage>` in plain HTML files of another site, in a real browser at a real server. */
import { mkdtempSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { join } from "node:path";
import { pathToFileURL } from "node:url";
import type { Page, WebSocket } from "playwright-core";
import { afterAll, beforeAll, expect, onTestFinished, test } from "vitest";
import type { BunrakuStage } from "../../src/element/stage-element";
import { describeInBrowser, type OpenOptions } from "./browser-suite";
import { createEmbeddingPage, waitForStages } from "./embedding-page";
import { startForeignSite } from "./foreign-site";
import { LEFT_HAND, tapKey, waitUntilSettled } from "./page-probe";
import { makeToken } from "./server";

const SECRET = "the secret of a server whose stage stands in other pages";

const site = await startForeignSite();
afterAll(() => site.stop());

describeInBrowser(
  "a stage in another site's page",
  { demo: true, secret: SECRET, origins: `${site.origin},null` },
  (own) => {
    let token: string;
    let session: string;
    let motion: string;

    beforeAll(async () => {
      token = makeToken(SECRET, "control");
      [session, motion] = await Promise.all(
        ["sessions", "motions"].map(async (what) => (await asked("GET", `/v1/${what}`)).items[0].id),
      );
    });

    async function asked(method: string, path: string, body?: unknown) {
      const headers = { Authorization: `Bearer ${token}`, "Content-Type": "application/json" };
      return (await (
        await fetch(own.url + path, { method, headers, ...(body ? { body: JSON.stringify(body) } : {}) })
      ).json()) as { items: { id: string }[]; link: string };
    }

    /** A page of the site. */
    async function open(stages: string, address = site.origin, opening: OpenOptions = {}): Promise<Page> {
      site.html = createEmbeddingPage(stages, own.url);
      return own.open(address, opening);
    }

    test("one script tag shows it, and its hand can be pulled by pointer and by keys", async () => {
      const page = await open(
        `<bunraku-stage src="${own.url}/?session=${session}&name=Aiko#token=${token}" controls style="width: 420px; margin: 30px"></bunraku-stage>`,
      );
      await waitForStages(page);
      await page.getByRole("button", { name: "Pause" }).click();
      await page.getByRole("button", { name: "Play", exact: true }).waitFor();
      await page.waitForFunction(() => document.querySelector("bunraku-stage")?.puppeteer?.id);
      // at the beginning of the dance the hands hang down, and have room upwards
      await asked("PATCH", `/v1/sessions/${session}`, { playing: false, position: 0 });
      await page.waitForFunction(() => {
        const viewer = document.querySelector("bunraku-stage")!.viewer!;
        const timeline = viewer.timelineHistory.at(viewer.presentationTime(performance.now()));
        return timeline !== null && !timeline.playing && timeline.position === 0 && viewer.blocks[0] >= 0;
      });
      const ring = await waitUntilSettled(page, () => ringOf(page), 0.5);
      await page.mouse.move(ring.x, ring.y);
      await page.mouse.down();
      await page.getByRole("button", { name: "Release the left hand" }).waitFor();
      await page.mouse.move(ring.x + 10, ring.y - 20, { steps: 3 });
      await page.mouse.move(ring.x + 20, ring.y - 45, { steps: 3 });
      await page.waitForFunction(({ limb }) => document.querySelector("bunraku-stage")?.puppeteer?.holds(limb), {
        limb: LEFT_HAND,
      });
      // the ring is where the pointer is, wherever the stage stands in the page
      const near = async () => ({
        away: Math.hypot(...Object.values(await ringOf(page)).map((at, axis) => at - [ring.x + 20, ring.y - 45][axis])),
      });
      expect((await waitUntilSettled(page, near, 0.5)).away).toBeLessThan(12);
      expect(await page.locator(".tag:visible").innerText()).toContain("You");
      await page.mouse.up();
      await page.getByRole("button", { name: "Take the left hand" }).waitFor();
      // the keys are the stage's while it has the focus
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

    test("attributes change live; moved it goes on, and removed it leaves nothing open", async () => {
      const lines: WebSocket[] = [];
      const before = async (page: Page) => void page.on("websocket", (line) => lines.push(line));
      const { link } = await asked("POST", "/v1/shares", { session });
      const page = await open(
        `<bunraku-stage src="${own.url}${link}" theme="night" style="width: 300px"></bunraku-stage><p></p>`,
        site.origin,
        { before },
      );
      await waitForStages(page);
      const openLines = () =>
        lines.filter((line) => !line.isClosed()).map((line) => new URL(line.url()).pathname.split("/").at(-1));
      await expect.poll(openLines).toEqual(["stream"]);
      expect(await page.getByRole("button").count()).toBe(0);
      const background = () =>
        page.locator("bunraku-stage").evaluate((stage) => getComputedStyle(stage).backgroundColor);
      const night = await background();
      await page.evaluate(() => (document.querySelector("bunraku-stage")!.theme = "day"));
      expect(await background()).not.toBe(night);

      // a link for viewers has no hands, whatever the page asks for
      await page.evaluate(() => (document.querySelector("bunraku-stage")!.controls = true));
      await waitForStages(page);
      // the line before is told of as closed a while after it was
      await expect.poll(openLines).toEqual(["stream"]);
      await expect
        .poll(() => page.getByRole("button").evaluateAll((all) => all.map((one) => one.getAttribute("title"))))
        .toEqual(["Sound on"]);
      await page.evaluate(
        (src) => (document.querySelector("bunraku-stage")!.src = src),
        `${own.url}/?session=${session}#token=${token}`,
      );
      await page.getByRole("button", { name: "Take the left hand" }).waitFor();
      await page.waitForFunction(() => document.querySelector("bunraku-stage")?.puppeteer?.id);
      await expect.poll(() => openLines().sort()).toEqual(["control", "stream"]);

      // a dance alone, on a timeline of one's own
      await page.evaluate(() => {
        const begun: string[] = [];
        document
          .querySelector("bunraku-stage")!
          .addEventListener("ready", () => begun.push(document.querySelector("bunraku-stage")!.viewer!.motion!));
        Object.assign(window, { begun });
      });
      await page.evaluate(
        (src) => (document.querySelector("bunraku-stage")!.src = src),
        `${own.url}/v1/motions/${motion}#token=${token}`,
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

      expect(await page.evaluate(() => (window as unknown as { begun: string[] }).begun)).toEqual([motion]);

      const kept = await page.evaluate(() => {
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
      expect(kept).toBe(true);
      await expect.poll(openLines).toEqual(["stream"]);
      const lost = await page.evaluate(() => {
        const stage = document.querySelector("bunraku-stage")!;
        const graphics = stage.stage!.renderer.getContext();
        Object.assign(window, { kept: stage });
        stage.remove();
        return new Promise((done) =>
          setTimeout(() =>
            done(graphics.isContextLost() && stage.viewer === null && stage.shadowRoot?.childElementCount === 0),
          ),
        );
      });
      expect(lost).toBe(true);
      await expect.poll(openLines).toEqual([]);
      // and it can come back
      await page.evaluate(() => document.body.append((window as unknown as { kept: BunrakuStage }).kept));
      await waitForStages(page);
    });

    test("several stand in one page, also in one opened from a file", async () => {
      const folder = mkdtempSync(join(tmpdir(), "bunraku-file-"));
      onTestFinished(() => rmSync(folder, { recursive: true }));
      const file = join(folder, "page.html");
      const src = `${own.url}/#token=${token}`;
      writeFileSync(
        file,
        createEmbeddingPage(
          `<bunraku-stage src="${src}" style="width: 200px"></bunraku-stage><bunraku-stage src="${src}" theme="day" style="width: 200px"></bunraku-stage>`,
          own.url,
        ),
      );
      const page = await own.open(pathToFileURL(file).href);
      await waitForStages(page, 2);
    });

    test("the page of examples shows each beside its source, under the server's own policy", async () => {
      const broken: string[] = [];
      const before = async (page: Page) => {
        await page.exposeFunction("broke", (what: string) => void broken.push(what));
        await page.addInitScript(() =>
          document.addEventListener(
            "securitypolicyviolation",
            (event) => void (window as unknown as { broke(what: string): void }).broke(event.violatedDirective),
          ),
        );
      };
      const page = await own.open(`/examples#token=${token}`, { before, colorScheme: "light" });
      expect(page.url()).toBe(`${own.url}/examples/`);
      await page.waitForFunction(() => document.querySelector("bunraku-stage")?.stage?.puppet?.group.visible);
      expect(
        await page.locator("bunraku-stage").evaluateAll((all) => all.map((one) => one.getAttribute("data-shown"))),
      ).toEqual(["day", "night", "day", "day"]);
      const sources = await page.locator("pre").allInnerTexts();
      for (const html of sources.slice(0, 3)) {
        expect(html).toContain(`<script type="module" src="${own.url}/embed/bunraku-stage.js"></script>`);
        expect(html).toContain(`<bunraku-stage src="${own.url}/"`);
        expect(html).not.toMatch(/data-|=""/);
      }
      expect(sources[0]).toContain(" controls>");
      expect(sources[3]).toContain(`from "${own.url}/embed/bunraku.js"`);
      const canvas = page.locator("#own-camera");
      await canvas.scrollIntoViewIfNeeded();
      const first = await canvas.screenshot();
      await expect.poll(async () => first.equals(await canvas.screenshot())).toBe(false);
      await page.getByRole("button", { name: "Dark theme" }).click();
      await page.getByRole("button", { name: "Light theme" }).waitFor();
      expect(broken).toEqual([]);
    });

    test("it says calmly why nothing is to be seen", async () => {
      const said = (page: Page, nth = 0) => page.locator("bunraku-stage .notice:not([hidden])").nth(nth);
      // the same page under a name that the server does not know
      const elsewhere = await open(
        `<bunraku-stage src="${own.url}/?session=${session}#token=${token}"></bunraku-stage>`,
        site.alias,
      );
      await said(elsewhere).getByText(`BUNRAKU_ORIGINS=${site.alias}`).waitFor();
      expect(await elsewhere.evaluate(() => document.querySelector("bunraku-stage")?.viewer)).toBeNull();

      const gone = new URL(own.url);
      gone.port = "9";
      const small = (src: string) => `<bunraku-stage src="${src}" style="width: 240px"></bunraku-stage>`;
      const errors = (page: Page) =>
        page.addInitScript(() => {
          Object.assign(window, { errors: [] as string[] });
          document.addEventListener(
            "error",
            (event) =>
              event instanceof CustomEvent && (window as unknown as { errors: string[] }).errors.push(event.detail),
            true,
          );
        });
      const page = await open([small(own.url), small("stage:here"), small(gone.origin)].join(""), site.origin, {
        before: errors,
      });
      await said(page, 0).getByText("A link is needed").waitFor();
      await said(page, 1).getByText("No stage here").waitFor();
      await said(page, 2).getByText("The stage does not answer").waitFor();
      expect(await page.evaluate(() => (window as unknown as { errors: string[] }).errors.length)).toBe(3);

      // away at first, it is there later
      const late = await open(small(`${own.url}/#token=${token}`), site.origin, {
        before: (page) => page.route("**/v1/sessions", (request) => request.abort()),
      });
      await said(late).getByText("Retrying automatically").waitFor();
      await late.unroute("**/v1/sessions");
      await waitForStages(late);
      await said(late).waitFor({ state: "hidden" });

      const blind = await open(small(`${own.url}/#token=${token}`), site.origin, {
        before: (page) => page.addInitScript(() => (HTMLCanvasElement.prototype.getContext = () => null)),
      });
      await said(blind).getByText("This browser cannot draw the stage").waitFor();
    });
  },
);

/** Where the left hand's ring is in the window, pixels. */
function ringOf(page: Page): Promise<{ x: number; y: number }> {
  return page.evaluate((limb) => {
    const element = document.querySelector("bunraku-stage")!;
    const stage = element.stage!;
    const { x, y } = stage.toScreen(stage.puppet!.handle(limb, stage.rig.group.position.clone()));
    const { left, top } = element.getBoundingClientRect();
    return { x: x + left, y: y + top };
  }, LEFT_HAND);
}
