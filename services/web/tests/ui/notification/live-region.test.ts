import { expect, test } from "vitest";
import { createLiveRegion } from "../../../src/ui/notification/live-region";

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
  const show = createLiveRegion<"line" | "graphics">(region as unknown as HTMLElement);
  show("line", region.words("lost"));
  show("graphics", region.words("dark"));
  expect(region.said).toEqual(["lost", "dark"]);
  show("graphics", null);
  expect(region.said).toEqual(["lost"]);
  show("line", region.words("ended"));
  expect(region.said).toEqual(["ended"]);
  show("graphics", null);
  show("line", null);
  show("line", null);
  expect(region.said).toEqual([]);
});
