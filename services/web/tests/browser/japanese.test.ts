/** The page in Japanese: texts, accessible names, translated server errors, and the switch to English. */
import { expect, test } from "vitest";
import { describeInBrowser } from "./browser-suite";
import { LEFT_HAND, waitForFirstPose, waitForHold, waitForWelcome } from "./page-probe";

const KANA = /[\p{Script=Hiragana}\p{Script=Katakana}\p{Script=Han}]/u;

describeInBrowser("Japanese page", { server: "open" }, ({ open }) => {
  test("a Japanese browser gets Japanese texts and accessible names", async () => {
    const page = await open("", { locale: "ja-JP", viewport: { width: 1280, height: 800 } });
    await waitForFirstPose(page);
    await waitForWelcome(page);
    expect(await page.evaluate(() => [document.documentElement.lang, document.title.endsWith(" - Bunraku")])).toEqual([
      "ja",
      true,
    ]);
    await page.getByRole("img", { name: "舞台で踊る木の人形" }).waitFor();
    for (const name of ["演目", "糸", "回線"]) {
      await page.getByRole("button", { name, exact: true }).click();
      await page
        .getByRole("complementary", { name, exact: true })
        .getByRole("heading", { name, exact: true })
        .waitFor();
    }
    await page.getByRole("slider", { name: "再生位置" }).waitFor();
    await page.getByRole("button", { name: "左手を持つ" }).click();
    await page.locator(".tag", { hasText: "左手" }).waitFor();
    expect(await page.locator(".tag", { hasText: "左手" }).innerText()).toContain("あなた");
    await page.getByRole("button", { name: "左手を放す" }).waitFor();
    await waitForHold(page, LEFT_HAND);
    await page.getByRole("button", { name: "キーとゲームパッド" }).click();
    await page.getByRole("dialog", { name: "キーとゲームパッド" }).getByText("1ブロック戻る").waitFor();
    // Every accessible name is translated, except the button to English.
    const names = await page.evaluate(() =>
      [...document.querySelectorAll("[aria-label]")].map((element) => element.getAttribute("aria-label") ?? ""),
    );
    expect(names.length).toBeGreaterThan(80);
    expect(names.filter((name) => !KANA.test(name))).toEqual(["English"]);
  });

  test("server errors are translated, and the choice of English is stored", async () => {
    const page = await open("?lang=ja", { locale: "en-GB" });
    await waitForFirstPose(page);
    await page
      .locator('input[type=file][accept*=".bvh"]')
      .setInputFiles({ name: "letter.bvh", mimeType: "text/plain", buffer: Buffer.from("Dear all,\n") });
    await page.getByRole("alert").getByText("BVHファイルではありません").waitFor();
    const session = new URL(page.url()).searchParams.get("session");
    await page.getByRole("button", { name: "English" }).click();
    await page.getByRole("button", { name: "日本語" }).waitFor();
    await waitForFirstPose(page);
    expect(await page.evaluate(() => document.documentElement.lang)).toBe("en");
    expect([new URL(page.url()).searchParams.get("session"), new URL(page.url()).searchParams.get("lang")]).toEqual([
      session,
      null,
    ]);
    await page.reload();
    await page.getByRole("button", { name: "Library", exact: true }).waitFor();
    // Back to Japanese by keyboard. The button's letter is drawn: no font is needed.
    const button = page.getByRole("button", { name: "日本語" });
    expect([await button.innerText(), await button.locator("svg").count()]).toEqual(["", 1]);
    await button.press("Enter");
    await page.getByRole("button", { name: "演目", exact: true }).waitFor();
  });

  test("the page is in English if the translations fail to load", async () => {
    const page = await open("?lang=ja", {
      before: (page) => page.route(/\/japanese-[^/]*\.js$/, (route) => route.abort()),
    });
    await page.getByRole("button", { name: "Library", exact: true }).waitFor();
    expect(await page.evaluate(() => document.documentElement.lang)).toBe("en");
    await waitForFirstPose(page);
  });
});
