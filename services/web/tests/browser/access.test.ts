/** Links in a real browser, at a real server with a secret: who may watch watches and no more, and is told when that is over. */
import { beforeAll, expect, test } from "vitest";
import { describeInBrowser } from "./browser-suite";
import { waitForFirstPose, waitForWelcome } from "./page-probe";
import { makeToken } from "./server";

const SECRET = "the secret of a server that a browser test started";

describeInBrowser("links", { demo: true, secret: SECRET }, (own) => {
  let admin: string;

  beforeAll(() => void (admin = makeToken(SECRET, "admin")));

  async function asAdmin(method: string, address: string, body?: unknown): Promise<Response> {
    const headers = { Authorization: `Bearer ${admin}`, "Content-Type": "application/json" };
    return fetch(`${own.url}${address}`, { method, headers, ...(body ? { body: JSON.stringify(body) } : {}) });
  }

  async function share(): Promise<{ id: string; link: string }> {
    const { items } = (await (await asAdmin("GET", "/v1/sessions")).json()) as { items: { id: string }[] };
    return (await (await asAdmin("POST", "/v1/shares", { session: items[0]?.id })).json()) as {
      id: string;
      link: string;
    };
  }

  test("one for viewers shows the dance without controls, and says when it is revoked", async () => {
    const { id, link } = await share();
    const page = await own.open(link);
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
    // neither key nor hand takes a string
    await page.keyboard.press("Digit2");
    await page.keyboard.press("Space");
    const told = await page.evaluate(() => {
      const { viewer, puppeteer } = window.bunraku;
      return { id: puppeteer.id, playing: viewer.timeline?.playing };
    });
    expect(told).toEqual({ id: null, playing: true });
    // the tab keeps it
    await page.reload();
    await waitForFirstPose(page);
    expect((await asAdmin("DELETE", `/v1/shares/${id}`)).status).toBe(204);
    const notice = page.locator(".notice");
    await notice.getByText("Link revoked").waitFor();
    expect(await notice.innerText()).toContain("ask for a new link");
    const late = await own.open(link);
    await late.locator(".notice").getByText("Link revoked").waitFor();
  });

  test("one to a dance alone shows that on a timeline of one's own", async () => {
    const { items } = (await (await asAdmin("GET", "/v1/motions")).json()) as { items: { id: string }[] };
    const { link } = (await (await asAdmin("POST", "/v1/shares", { motion: items[0]?.id })).json()) as { link: string };
    const page = await own.open(link);
    await waitForFirstPose(page);
    expect(page.url()).not.toContain("#");
    await page.getByRole("button", { name: "Pause" }).click();
    await page.getByRole("button", { name: "Play", exact: true }).waitFor();
    expect(await page.getByRole("button", { name: "Strings", exact: true }).isVisible()).toBe(false);
    await page.reload();
    await waitForFirstPose(page);
  });

  test("the operator's has everything, and its page makes one for viewers", async () => {
    const page = await own.open(`/#token=${admin}`);
    await waitForFirstPose(page);
    expect(page.url()).not.toContain("token");
    await waitForWelcome(page);
    await page.getByRole("button", { name: "Pause" }).click();
    await page.getByRole("button", { name: "Play", exact: true }).waitFor();
    await page.getByRole("button", { name: "Play", exact: true }).click();
    await page.getByRole("button", { name: "Share link" }).click();
    // looked at as soon as it is there, as it does not stay
    const [copied] = /http\S+/.exec(await page.locator(".toast").innerText()) ?? [
      await page.evaluate(() => navigator.clipboard.readText().catch(() => "")),
    ];
    const shares = (await (await asAdmin("GET", "/v1/shares")).json()) as { items: { by: string }[] };
    expect(shares.items[0]?.by).toBe("operator");
    if (copied) {
      const guest = await own.open(copied);
      await waitForFirstPose(guest);
      expect(await guest.getByRole("button", { name: "Pause" }).isVisible()).toBe(false);
    }
  });

  test("without one the page says calmly what to do", async () => {
    const page = await own.open();
    const notice = page.locator(".notice");
    await notice.getByText("A link is needed").waitFor();
    expect(await notice.innerText()).toContain("ask its host for a link");
  });
});
