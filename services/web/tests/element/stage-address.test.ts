import { expect, test } from "vitest";
import { parseStageAddress } from "../../src/element/stage-address";

const HERE = "https://site.example/article/";

test.each([
  ["https://stage.example", "https://stage.example", "sessions", null, null],
  ["https://stage.example/?session=s1#share=a.b-c_d", "https://stage.example", "sessions", "s1", "a.b-c_d"],
  ["http://127.0.0.1:8000/?motion=m1#token=t.t.t", "http://127.0.0.1:8000", "motions", "m1", "t.t.t"],
  ["https://stage.example/?session=s1&motion=m1", "https://stage.example", "sessions", "s1", null],
  ["https://stage.example/v1/sessions/s1", "https://stage.example", "sessions", "s1", null],
  ["https://stage.example/v1/sessions/s1/stream", "https://stage.example", "sessions", "s1", null],
  ["https://stage.example/v1/motions/a%20b/#share=a.b.c", "https://stage.example", "motions", "a b", "a.b.c"],
  ["/?session=s1", "https://site.example", "sessions", "s1", null],
  ["https://stage.example/?session=", "https://stage.example", "sessions", null, null],
])("address %s is parsed", (src, server, kind, id, token) => {
  const address = parseStageAddress(src, HERE);
  expect(address && { ...address, query: undefined }).toEqual({ server, kind, id, token, query: undefined });
});

test("further query parameters are available", () => {
  expect(parseStageAddress("https://stage.example/?session=s1&name=Aiko", HERE)?.query.get("name")).toBe("Aiko");
});

test.each(["http://", "javascript:alert(1)", "file:///stage", "ws://stage.example/v1/sessions/s1/stream"])(
  "address %s is rejected",
  (src) => {
    expect(parseStageAddress(src, HERE)).toBeNull();
  },
);

test("relative address in a page from a file is rejected", () => {
  expect(parseStageAddress("/?session=s1", "file:///home/page.html")).toBeNull();
});
