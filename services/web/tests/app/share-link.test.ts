import { afterEach, expect, test, vi } from "vitest";
import { copyShareLink } from "../../src/app/share-link";

afterEach(() => void vi.unstubAllGlobals());

/** What is copied and what is told where the page is at `href` and the clipboard takes what it is given, or refuses it. */
async function shared(
  href: string,
  session: string | null,
  takes: boolean,
): Promise<{ copied: string[]; told: string[] }> {
  const [copied, told]: [string[], string[]] = [[], []];
  const writeText = (text: string) =>
    takes ? Promise.resolve(void copied.push(text)) : Promise.reject(new Error("not allowed"));
  vi.stubGlobal("location", new URL(href));
  vi.stubGlobal("navigator", { clipboard: { writeText } });
  await copyShareLink(session, (message) => told.push(message));
  return { copied, told };
}

test("the link is the page's address with its session and nothing else of the query", async () => {
  const { copied, told } = await shared("http://stage.example/?name=Aiko&lang=ja", "a b", true);
  expect(copied).toEqual(["http://stage.example/?session=a%20b"]);
  expect(told).toEqual(["Link copied"]);
});

test("without a session it is the page's address", async () => {
  expect((await shared("http://stage.example/?motion=m", null, true)).copied).toEqual(["http://stage.example/"]);
});

test("where nothing may be copied the link is told", async () => {
  const { copied, told } = await shared("http://stage.example/", "s", false);
  expect(copied).toEqual([]);
  expect(told).toEqual(["Copy this link: http://stage.example/?session=s"]);
});
