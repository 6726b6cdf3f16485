/** Language of embedded stages: each follows the nearest `lang` attribute. */
import type { Page } from "playwright-core";
import { expect, test } from "vitest";
import { describeInBrowser, type OpenOptions } from "./browser-suite";
import { countLoadedScripts, createEmbeddingPage, waitForStages } from "./embedding-page";

const JAPANESE = /[\p{Script=Hiragana}\p{Script=Katakana}\p{Script=Han}]/u;
/** Script with the Japanese translations. */
const JAPANESE_SCRIPT = /^japanese-.*\.js$/;

describeInBrowser("language of embedded stages", { server: "guarded" }, (fixture) => {
  async function open(stages: string, options: OpenOptions = {}): Promise<Page> {
    const path = await fixture.publish(createEmbeddingPage(stages, fixture.url));
    return fixture.open(fixture.site.origin + path, options);
  }

  /** Return the HTML of a stage with controls. */
  function stage(attributes: string, session = fixture.session): string {
    const address = `${fixture.url}/?session=${session}#token=${fixture.tokens?.control}`;
    return `<bunraku-stage src="${address}" controls style="width: 240px" ${attributes}></bunraku-stage>`;
  }

  test("each stage follows the nearest lang attribute, also when it changes", async () => {
    const page = await open(
      `<div lang="ja-JP"><p>${stage('id="first"')}</p><p>${stage('id="second" lang="en-GB"')}</p></div>`,
    );
    const [first, second] = ["#first", "#second"].map((id) => page.locator(id));
    await waitForStages(page, 2);
    await first.getByRole("button", { name: "左手を持つ" }).waitFor();
    await second.getByRole("button", { name: "Take the left hand" }).waitFor();
    expect(await texts(page, "#first")).toEqual({ language: "ja", foreign: [] });
    expect(await texts(page, "#second")).toEqual({ language: "en", foreign: [] });
    expect(await countLoadedScripts(page, JAPANESE_SCRIPT)).toBe(1);
    // Each stage names the puppeteer in its own language.
    await first.getByRole("button", { name: "左手を持つ" }).click();
    await first.getByRole("button", { name: "左手を放す" }).waitFor();
    await first.locator(".tag:visible", { hasText: "あなた" }).waitFor();
    await second.getByRole("button", { name: "Left hand, held by" }).waitFor();
    await second.locator(".tag:visible", { hasText: "left hand" }).waitFor();

    await page.evaluate(() => document.querySelector("#second")!.setAttribute("lang", "ja"));
    await second.getByRole("button", { name: "右手を持つ" }).waitFor();
    await waitForStages(page, 2);
    await page.evaluate(() => document.querySelector("div")!.removeAttribute("lang"));
    await first.getByRole("button", { name: "Take the right hand" }).waitFor();
    await second.getByRole("button", { name: "右手を持つ" }).waitFor();
    await waitForStages(page, 2);
    // Moved into an element of another language.
    await page.evaluate(() => {
      document.documentElement.lang = "ja";
      document.querySelector("div")!.lang = "en";
      document.body.append(document.querySelector("#first")!);
    });
    await first.getByRole("button", { name: "右手を持つ" }).waitFor();
    expect(await texts(page, "#first")).toEqual({ language: "ja", foreign: [] });
    expect(await texts(page, "#second")).toEqual({ language: "ja", foreign: [] });
  });

  test("errors are shown in the language of the stage", async () => {
    const page = await open(
      stage('id="first" lang="ja"', "nowhere") +
        stage('id="second"', "nowhere") +
        '<bunraku-stage lang="ja" src="stage:here" style="width: 240px"></bunraku-stage>',
    );
    await page.locator("#first .notice").getByText("舞台'nowhere'はありません").waitFor();
    await page.locator("#second .notice").getByText("there is no session 'nowhere'").waitFor();
    await page.getByText("ここに舞台はありません").waitFor();
    // Inside the shadow root of another element.
    await page.evaluate(() => {
      const host = document.querySelector("h1")!;
      host.lang = "ja";
      host.attachShadow({ mode: "open" }).innerHTML = '<bunraku-stage src="stage:within"></bunraku-stage>';
    });
    await page.getByText('"stage:within"は舞台のアドレスではありません。').waitFor();
  });

  test("text is English for other languages and if Japanese fails to load", async () => {
    const french = await open(`<div lang="fr">${stage("")}</div>`, { locale: "ja-JP" });
    await french.getByRole("button", { name: "Take the left hand" }).waitFor();
    expect(await texts(french, "bunraku-stage")).toEqual({ language: "en", foreign: [] });
    expect(await countLoadedScripts(french, JAPANESE_SCRIPT)).toBe(0);
    const offline = await open(stage('lang="ja"'), {
      before: (page) => page.route(/\/japanese-[^/]*\.js$/, (route) => route.abort()),
    });
    await offline.getByRole("button", { name: "Take the left hand" }).waitFor();
    expect(await texts(offline, "bunraku-stage")).toEqual({ language: "en", foreign: [] });
  });
});

/** Return the language declared by a stage, and its accessible names and titles that are in the other language. */
async function texts(page: Page, selector: string): Promise<{ language: string; foreign: string[] }> {
  const { language, names } = await page.locator(selector).evaluate((stage) => ({
    language: stage.shadowRoot!.querySelector<HTMLElement>(".frame")!.lang,
    names: [...stage.shadowRoot!.querySelectorAll("[aria-label], [title]")]
      .flatMap((element) => [element.getAttribute("aria-label"), element.getAttribute("title")])
      .filter((name) => name !== null),
  }));
  expect(names.length).toBeGreaterThan(10);
  return { language, foreign: names.filter((name) => JAPANESE.test(name) !== (language === "ja")) };
}
