/** What stages in another site's page say, each in the language of where it stands. */
import type { Page } from "playwright-core";
import { afterAll, beforeAll, expect, test } from "vitest";
import { describeInBrowser, type OpenOptions } from "./browser-suite";
import { countLoadedScripts, createEmbeddingPage, waitForStages } from "./embedding-page";
import { startForeignSite } from "./foreign-site";
import { makeToken } from "./server";

const SECRET = "the secret of a server whose stages speak two languages";
const JAPANESE = /[\p{Script=Hiragana}\p{Script=Katakana}\p{Script=Han}]/u;
/** The script with the Japanese words. */
const WORDS = /^japanese-.*\.js$/;

const site = await startForeignSite();
afterAll(() => site.stop());

describeInBrowser(
  "the words of stages in another site's page",
  { demo: true, secret: SECRET, origins: site.origin },
  (own) => {
    let token: string;

    beforeAll(() => void (token = makeToken(SECRET, "control")));

    async function open(stages: string, opening: OpenOptions = {}): Promise<Page> {
      site.html = createEmbeddingPage(stages, own.url);
      return own.open(site.origin, opening);
    }

    function stage(attributes: string, address = `/#token=${token}`): string {
      return `<bunraku-stage src="${own.url}${address}" controls style="width: 240px" ${attributes}></bunraku-stage>`;
    }

    test("are of the nearest language, each stage its own, and follow it", async () => {
      const page = await open(
        `<div lang="ja-JP"><p>${stage('id="one"')}</p><p>${stage('id="two" lang="en-GB"')}</p></div>`,
      );
      const [one, two] = ["#one", "#two"].map((id) => page.locator(id));
      await waitForStages(page, 2);
      await one.getByRole("button", { name: "左手を持つ" }).waitFor();
      await two.getByRole("button", { name: "Take the left hand" }).waitFor();
      expect(await said(page, "#one")).toEqual({ language: "ja", others: [] });
      expect(await said(page, "#two")).toEqual({ language: "en", others: [] });
      expect(await countLoadedScripts(page, WORDS)).toBe(1);
      // who holds it is named in each by its own word
      await one.getByRole("button", { name: "左手を持つ" }).click();
      await one.getByRole("button", { name: "左手を放す" }).waitFor();
      await one.locator(".tag:visible", { hasText: "あなた" }).waitFor();
      await two.getByRole("button", { name: "Left hand, held by" }).waitFor();
      await two.locator(".tag:visible", { hasText: "left hand" }).waitFor();

      await page.evaluate(() => document.querySelector("#two")!.setAttribute("lang", "ja"));
      await two.getByRole("button", { name: "右手を持つ" }).waitFor();
      await waitForStages(page, 2);
      await page.evaluate(() => document.querySelector("div")!.removeAttribute("lang"));
      await one.getByRole("button", { name: "Take the right hand" }).waitFor();
      await two.getByRole("button", { name: "右手を持つ" }).waitFor();
      await waitForStages(page, 2);
      // moved to where another is spoken
      await page.evaluate(() => {
        document.documentElement.lang = "ja";
        document.querySelector("div")!.lang = "en";
        document.body.append(document.querySelector("#one")!);
      });
      await one.getByRole("button", { name: "右手を持つ" }).waitFor();
      expect(await said(page, "#one")).toEqual({ language: "ja", others: [] });
      expect(await said(page, "#two")).toEqual({ language: "ja", others: [] });
    });

    test("also tell in it what is in the way", async () => {
      const gone = `/?session=nowhere#token=${token}`;
      const page = await open(
        `${stage('id="one" lang="ja"', gone)}${stage('id="two"', gone)}<bunraku-stage lang="ja" src="stage:here" style="width: 240px"></bunraku-stage>`,
      );
      await page.locator("#one .notice").getByText("舞台'nowhere'はありません").waitFor();
      await page.locator("#two .notice").getByText("there is no session 'nowhere'").waitFor();
      await page.getByText("ここに舞台はありません").waitFor();
      // also within another element's shadow
      await page.evaluate(() => {
        const host = document.querySelector("h1")!;
        host.lang = "ja";
        host.attachShadow({ mode: "open" }).innerHTML = '<bunraku-stage src="stage:within"></bunraku-stage>';
      });
      await page.getByText('"stage:within"は舞台のアドレスではありません。').waitFor();
    });

    test("are English where no other is asked for, and where the Japanese cannot be fetched", async () => {
      const plain = await open(`<div lang="fr">${stage("")}</div>`, { locale: "ja-JP" });
      await plain.getByRole("button", { name: "Take the left hand" }).waitFor();
      expect(await said(plain, "bunraku-stage")).toEqual({ language: "en", others: [] });
      expect(await countLoadedScripts(plain, WORDS)).toBe(0);
      const cut = await open(stage('lang="ja"'), {
        before: (page) => page.route(/\/japanese-[^/]*\.js$/, (route) => route.abort()),
      });
      await cut.getByRole("button", { name: "Take the left hand" }).waitFor();
      expect(await said(cut, "bunraku-stage")).toEqual({ language: "en", others: [] });
    });
  },
);

/** The language that a stage says it speaks, and what it says for screen readers and in titles that is of the other one. */
async function said(page: Page, selector: string): Promise<{ language: string; others: string[] }> {
  const { language, names } = await page.locator(selector).evaluate((stage) => ({
    language: stage.shadowRoot!.querySelector<HTMLElement>(".frame")!.lang,
    names: [...stage.shadowRoot!.querySelectorAll("[aria-label], [title]")]
      .flatMap((one) => [one.getAttribute("aria-label"), one.getAttribute("title")])
      .filter((name) => name !== null),
  }));
  expect(names.length).toBeGreaterThan(10);
  return { language, others: names.filter((name) => JAPANESE.test(name) !== (language === "ja")) };
}
