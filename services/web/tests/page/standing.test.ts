import { expect, test } from "vitest";
import { createStanding } from "../../src/page/standing";

/** As much of a live region as is asked of one. */
class Region {
  readonly said: string[] = [];

  append(one: { text: string }): void {
    this.said.push(one.text);
  }

  words(text: string): HTMLElement {
    return { text, remove: () => void this.said.splice(this.said.indexOf(text), 1) } as unknown as HTMLElement;
  }
}

test("what is said stands until its own cause takes it away, or says something else", () => {
  const region = new Region();
  const say = createStanding<"line" | "graphics">(region as unknown as HTMLElement);
  say("line", region.words("lost"));
  say("graphics", region.words("dark"));
  expect(region.said).toEqual(["lost", "dark"]);
  say("graphics", null);
  expect(region.said).toEqual(["lost"]);
  say("line", region.words("ended"));
  expect(region.said).toEqual(["ended"]);
  say("graphics", null);
  say("line", null);
  say("line", null);
  expect(region.said).toEqual([]);
});
