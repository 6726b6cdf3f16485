/** Share links on a server that requires tokens: viewers get no controls and are notified when the link is revoked. */
import { beforeAll, expect, test } from "vitest";
import { describeInBrowser } from "./browser-suite";
import { waitForFirstPose, waitForWelcome } from "./page-probe";
import { makeToken } from "./server";

const SECRET = "the secret of a server that a browser test started";

describeInBrowser("access with links", { demo: true, secret: SECRET }, (fixture) => {
  let admin: string;

  beforeAll(() => void (admin = makeToken(SECRET, "admin")));

  async function requestAsAdmin(method: string, address: string, body?: unknown): Promise<Response> {
    const headers = { Authorization: `Bearer ${admin}`, "Content-Type": "application/json" };
    return fetch(`${fixture.url}${address}`, { method, headers, ...(body ? { body: JSON.stringify(body) } : {}) });
  }

  async function shareSession(): Promise<{ id: string; link: string }> {
    const { items } = (await (await requestAsAdmin("GET", "/v1/sessions")).json()) as { items: { id: string }[] };
    return (await (await requestAsAdmin("POST", "/v1/shares", { session: items[0]?.id })).json()) as {
      id: string;
      link: string;
    };
  }

  test("a viewer link shows no controls, and a notice once it is revoked", async () => {
    const { id, link } = await shareSession();
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
    const state = await page.evaluate(() => {
      const { viewer, puppeteer } = window.bunraku;
      return { id: puppeteer.id, playing: viewer.timeline?.playing };
    });
    expect(state).toEqual({ id: null, playing: true });
    // The tab keeps the token.
    await page.reload();
    await waitForFirstPose(page);
    expect((await requestAsAdmin("DELETE", `/v1/shares/${id}`)).status).toBe(204);
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
    const { items } = (await (await requestAsAdmin("GET", "/v1/motions")).json()) as { items: { id: string }[] };
    const { link } = (await (await requestAsAdmin("POST", "/v1/shares", { motion: items[0]?.id })).json()) as {
      link: string;
    };
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
    const page = await fixture.open(`/#token=${admin}`);
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
    const shares = (await (await requestAsAdmin("GET", "/v1/shares")).json()) as { items: { by: string }[] };
    expect(shares.items[0]?.by).toBe("operator");
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
});
