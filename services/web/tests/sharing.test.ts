import { afterEach, beforeEach, expect, test, vi } from "vitest";
import { shareLink } from "../src/sharing";

let toasts: string[];
let copied: string[];

beforeEach(() => {
  [toasts, copied] = [[], []];
  vi.stubGlobal("location", { href: "https://stage.example/?motion=m1&quality=best" });
  vi.stubGlobal("navigator", { clipboard: { writeText: (text: string) => Promise.resolve(void copied.push(text)) } });
});
afterEach(() => void vi.unstubAllGlobals());

test("the link is the session's alone, and copied", async () => {
  await shareLink({ id: "s/1" }, (message) => toasts.push(message));
  expect([copied, toasts]).toEqual([["https://stage.example/?session=s%2F1"], ["Link copied"]]);
});

test("where nothing can be copied it is shown; with nothing on the stage it is the page's", async () => {
  vi.stubGlobal("navigator", { clipboard: { writeText: () => Promise.reject(new Error("not allowed")) } });
  await shareLink(null, (message) => toasts.push(message));
  expect([copied, toasts]).toEqual([[], ["Copy this link: https://stage.example/"]]);
});
