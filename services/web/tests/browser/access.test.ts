/** Share links on a server that requires tokens: viewers get no controls and are notified when the link is revoked. */
import { expect, test } from "vitest";
import { describeInBrowser } from "./browser-suite";
import { evaluateInEngine } from "./engine-probe";
import { waitForFirstPose, waitForWelcome } from "./page-probe";

interface Share {
  id: string;
  link: string;
}

describeInBrowser("access with links", { server: "guarded" }, (fixture) => {
  test("a viewer link shows no controls, and a notice once it is revoked", async () => {
    const { id, link } = await fixture.request<Share>("POST", "/v1/shares", { session: fixture.session });
    const page = await fixture.open(link);
    await waitForFirstPose(page);
    expect(page.url()).not.toContain("#");
    expect(page.url()).not.toContain("share");
    expect(await page.evaluate(() => history.length)).toBeLessThan(3);
    for (const name of ["Pause", "Loop", "Share link", "Keep this", "Library", "Strings"]) {
      expect(await page.getByRole("button", { name, exact: true }).isVisible(), name).toBe(false);
    }
    expect(await page.getByRole("navigation", { name: "Take a string" }).isVisible()).toBe(false);
    expect(await page.getByRole("button", { name: "Connection" }).isVisible()).toBe(true);
    await expect.poll(() => page.locator(".brand-piece").innerText()).not.toBe("");
    // Keys neither claim a limb nor pause.
    await page.keyboard.press("Digit2");
    await page.keyboard.press("Space");
    const state = await evaluateInEngine(page, () => {
      const { viewer, puppeteer } = globalThis.bunraku;
      return { id: puppeteer.id, playing: viewer.timeline?.playing };
    });
    expect(state).toEqual({ id: null, playing: true });
    // The tab keeps the token.
    await page.reload();
    await waitForFirstPose(page);
    await fixture.request("DELETE", `/v1/shares/${id}`);
    const notice = page.locator(".notice");
    await notice.getByText("Link revoked").waitFor();
    expect(await notice.innerText()).toContain("ask for a new link");
    const secondPage = await fixture.open(link);
    await secondPage.locator(".notice").getByText("Link revoked").waitFor();
  });

  test("the API reference needs no token, no other site and no exception from its policy", async () => {
    const errors: string[] = [];
    const addresses: string[] = [];
    const page = await fixture.open("v1/docs", {
      before: async (opened) => {
        opened.on("console", (message) => message.type() === "error" && errors.push(message.text()));
        opened.on("request", (request) => addresses.push(request.url()));
      },
    });
    const section = page.locator("#post-v1-shares");
    await section.getByText("Role control").waitFor();
    expect(await section.locator("pre").first().innerText()).toContain("seconds?: integer");
    expect(await page.locator("main section").count()).toBeGreaterThan(20);
    expect(errors).toEqual([]);
    const isOwn = (address: string): boolean => address.startsWith("data:") || address.startsWith(fixture.url);
    expect(addresses.filter((address) => !isOwn(address))).toEqual([]);
  });

  test("a link to a motion plays it on a private timeline", async () => {
    const { link } = await fixture.request<Share>("POST", "/v1/shares", { motion: fixture.motion });
    const page = await fixture.open(link);
    await waitForFirstPose(page);
    expect(page.url()).not.toContain("#");
    await page.getByRole("button", { name: "Pause" }).click();
    await page.getByRole("button", { name: "Play", exact: true }).waitFor();
    expect(await page.getByRole("button", { name: "Strings", exact: true }).isVisible()).toBe(false);
    await page.reload();
    await waitForFirstPose(page);
  });

  test("an admin link gives all controls and can create a viewer link", async () => {
    const page = await fixture.open(`/#token=${fixture.tokens?.admin}`);
    await waitForFirstPose(page);
    expect(page.url()).not.toContain("token");
    await waitForWelcome(page);
    await page.getByRole("button", { name: "Pause" }).click();
    await page.getByRole("button", { name: "Play", exact: true }).waitFor();
    await page.getByRole("button", { name: "Play", exact: true }).click();
    await page.getByRole("button", { name: "Share link" }).click();
    // Read at once, because the toast disappears.
    const [viewerLink] = /http\S+/.exec(await page.locator(".toast").innerText()) ?? [
      await page.evaluate(() => navigator.clipboard.readText().catch(() => "")),
    ];
    const shares = await fixture.request<{ items: { by: string; session: string | null }[] }>("GET", "/v1/shares");
    expect(shares.items.find(({ session }) => session === fixture.session)?.by).toBe("operator");
    if (viewerLink) {
      const viewer = await fixture.open(viewerLink);
      await waitForFirstPose(viewer);
      expect(await viewer.getByRole("button", { name: "Pause" }).isVisible()).toBe(false);
    }
  });

  test("without a token the page asks for a link", async () => {
    const page = await fixture.open();
    const notice = page.locator(".notice");
    await notice.getByText("A link is needed").waitFor();
    expect(await notice.innerText()).toContain("ask its host for a link");
  });

  test("a rejected connection and a rejected request are reported once", async () => {
    const page = await fixture.open("", {
      before: (opened) =>
        opened.route("**/v1/motions*", async (route) => {
          await opened.locator(".notice").getByText("The session has ended").waitFor();
          await route.continue();
        }),
    });
    const notice = page.locator(".notice");
    await notice.getByText("ask its host for a link").waitFor();
    expect(await notice.locator("p").count()).toBe(1);
  });
});
