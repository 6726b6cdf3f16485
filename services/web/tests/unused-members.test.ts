import { expect, test } from "vitest";
import { unusedMembers, withoutMembers } from "../unused-members.ts";

const LIBRARY = `
class Place {
  constructor() { this.x = 0; this.reset = function () { this.x = this.first(); }; }
  first() { return 1; }
  told() { return this.deep(); }
  deep() { return this.x; }
  round() { return this.again(); }
  again() { return this.round(); }
  get width() { return 2; }
  set width(to) { this.x = to; }
  static made() { return new Place(); }
  toString() { return "place"; }
  [Symbol.iterator]() { return [].values(); }
}
export { Place };`;

function unused(...programs: string[]): string[] {
  return [
    ...unusedMembers([{ code: LIBRARY, cuttable: true }, ...programs.map((code) => ({ code, cuttable: false }))]),
  ].sort();
}

test("a member stays while anything that stays says its name", () => {
  expect(unused("")).toEqual(["again", "deep", "first", "made", "reset", "round", "told", "width"]);
  expect(unused("place.told()")).toEqual(["again", "first", "made", "reset", "round", "width"]);
  expect(unused("place.reset(place.width)")).toEqual(["again", "deep", "made", "round", "told"]);
  expect(unused("const { made } = Place; made().again()")).toEqual(["deep", "first", "reset", "told", "width"]);
});

test("words of texts are names too", () => {
  expect(unused("place['told']()")).not.toContain("told");
  expect(unused("const calls = ['first told']")).toEqual(["again", "made", "reset", "round", "width"]);
  expect(unused("const name = `${kind}.width`")).not.toContain("width");
});

test("members of classes that may not be cut stay, and keep what they say", () => {
  expect(unused("class Own { never() { return this.place.deep(); } }")).toEqual([
    "again",
    "first",
    "made",
    "reset",
    "round",
    "told",
    "width",
  ]);
});

test("what is left of a module runs", async () => {
  const rest = withoutMembers(
    LIBRARY,
    unusedMembers([
      { code: LIBRARY, cuttable: true },
      { code: "place.reset()", cuttable: false },
    ]),
  );
  const { Place } = (await import(/* @vite-ignore */ `data:text/javascript,${encodeURIComponent(rest)}`)) as {
    Place: new () => Record<string, unknown> & { reset(): void };
  };
  const place = new Place();
  place.reset();
  expect([place["x"], String(place), [...(place as unknown as Iterable<unknown>)]]).toEqual([1, "place", []]);
  for (const gone of ["told", "deep", "round", "again", "width"]) expect(gone in place, gone).toBe(false);
  expect("made" in Place).toBe(false);
});

test("a module without such members is as it was", () => {
  expect(withoutMembers(LIBRARY, new Set(["other"]))).toBe(LIBRARY);
});
