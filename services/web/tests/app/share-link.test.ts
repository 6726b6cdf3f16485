import { afterEach, expect, test, vi } from "vitest";
import { copyShareLink } from "../../src/app/share-link";
import { pageAccess } from "../../src/client/access";
import { formatTime } from "../../src/i18n/number-format";

afterEach(() => {
  vi.unstubAllGlobals();
  vi.restoreAllMocks();
});

/** Copy a link from a page at `href`; return the texts copied to the clipboard and the messages shown. */
async function copyFrom(
  href: string,
  session: string | null,
  clipboardAllowed: boolean,
): Promise<{ copied: string[]; messages: string[] }> {
  const [copied, messages]: [string[], string[]] = [[], []];
  const writeText = (text: string) =>
    clipboardAllowed ? Promise.resolve(void copied.push(text)) : Promise.reject(new Error("not allowed"));
  vi.stubGlobal("location", new URL(href));
  vi.stubGlobal("navigator", { clipboard: { writeText } });
  await copyShareLink(session, (message) => messages.push(message));
  return { copied, messages };
}

test("link contains the session and nothing else of the page's query", async () => {
  const { copied, messages } = await copyFrom("http://stage.example/?name=Aiko&lang=ja", "a b", true);
  expect(copied).toEqual(["http://stage.example/?session=a%20b"]);
  expect(messages).toEqual(["Link copied"]);
});

test("link without a session is the page's address", async () => {
  expect((await copyFrom("http://stage.example/?motion=m", null, true)).copied).toEqual(["http://stage.example/"]);
});

test("link is shown if the clipboard is not available", async () => {
  const { copied, messages } = await copyFrom("http://stage.example/", "s", false);
  expect(copied).toEqual([]);
  expect(messages).toEqual(["Copy this link: http://stage.example/?session=s"]);
});

test("link with a token says until when it can be used", async () => {
  const expires = "2026-12-24T18:30:00Z";
  const answer = { link: "/?session=s#share=t", expires };
  vi.stubGlobal("fetch", () => Promise.resolve(new Response(JSON.stringify(answer), { status: 201 })));
  vi.spyOn(pageAccess, "hasToken", "get").mockReturnValue(true);
  const { copied, messages } = await copyFrom("http://stage.example/", "s", true);
  expect(copied).toEqual(["http://stage.example/?session=s#share=t"]);
  expect(messages).toEqual([`Link copied. Anyone who has it can watch until ${formatTime(expires)}`]);
  expect(formatTime(expires)).toMatch(/^December 2[345]\D+\d+:\d0/);
});
