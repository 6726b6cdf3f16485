import { expect, test } from "vitest";
import { createLiveRegion } from "../../../src/ui/notification/live-region";

/** Element that records its children's texts. */
class FakeRegion {
  readonly texts: string[] = [];

  append(message: { text: string }): void {
    this.texts.push(message.text);
  }

  message(text: string): HTMLElement {
    return { text, remove: () => void this.texts.splice(this.texts.indexOf(text), 1) } as unknown as HTMLElement;
  }
}

test("message stays until its cause removes or replaces it", () => {
  const region = new FakeRegion();
  const show = createLiveRegion<"connection" | "graphics">(region as unknown as HTMLElement);
  show("connection", region.message("lost"));
  show("graphics", region.message("dark"));
  expect(region.texts).toEqual(["lost", "dark"]);
  show("graphics", null);
  expect(region.texts).toEqual(["lost"]);
  show("connection", region.message("ended"));
  expect(region.texts).toEqual(["ended"]);
  show("graphics", null);
  show("connection", null);
  show("connection", null);
  expect(region.texts).toEqual([]);
});
