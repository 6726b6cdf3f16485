/** Steps of a user on a page, and waits for what a user sees. */
import type { BrowserWindow, KeyAction, PointerAction, PointerType } from "./browser";
import { WAIT_TIMEOUT_MS } from "./browser";

/** Interval at which a page looks for what is waited for, in milliseconds. */
const POLL_INTERVAL_MS = 50;

export interface Point {
  x: number;
  y: number;
}

/** Call `body` in the page with JSON values, await its result and return it as a JSON value. */
export async function evaluate<Args extends unknown[], Result>(
  window: BrowserWindow,
  body: (...args: Args) => Result | Promise<Result>,
  ...args: Args
): Promise<Result> {
  const declaration = `async (json) => JSON.stringify(await (${body})(...JSON.parse(json))) ?? "null"`;
  return JSON.parse(await window.call(declaration, JSON.stringify(args))) as Result;
}

/** Wait until `condition` is true in the page, and return its result. `what` is named if it never is. */
export async function waitFor<Args extends unknown[], Result>(
  window: BrowserWindow,
  what: string,
  condition: (...args: Args) => Result | Promise<Result>,
  ...args: Args
): Promise<NonNullable<Result>> {
  const declaration = `async (json) => {
    for (const until = performance.now() + ${WAIT_TIMEOUT_MS}; performance.now() < until; ) {
      const found = await (${condition})(...JSON.parse(json));
      if (found) return JSON.stringify(found);
      await new Promise((resolve) => setTimeout(resolve, ${POLL_INTERVAL_MS}));
    }
    return "null";
  }`;
  const found = JSON.parse(await window.call(declaration, JSON.stringify(args))) as Result;
  if (found === null) {
    const text = await evaluate(window, () => document.body.innerText.replaceAll("\n", " | "));
    throw new Error(`The page did not show ${what} within ${WAIT_TIMEOUT_MS / 1000} s. It shows: ${text}`);
  }
  return found as NonNullable<Result>;
}

/** Wait until the page has drawn its first performer. */
export async function waitForStart(window: BrowserWindow): Promise<void> {
  await waitFor(window, "the stage", () => !document.documentElement.hasAttribute("data-arriving"));
  await waitForButton(window, "Take the left hand");
}

/** Wait for a button that is visible and enabled, and return its centre and whether it is pressed. */
export function waitForButton(window: BrowserWindow, name: string): Promise<Point & { isPressed: boolean }> {
  return waitFor(
    window,
    `the button "${name}"`,
    (name) => {
      const elements = [...document.querySelectorAll("bunraku-stage")];
      const roots = [document, ...elements.flatMap(({ shadowRoot }) => shadowRoot ?? [])];
      for (const button of roots.flatMap((root) => [...root.querySelectorAll("button")])) {
        const { left, top, width, height } = button.getBoundingClientRect();
        const label = button.getAttribute("aria-label") ?? button.textContent?.trim();
        if (label === name && width > 0 && !button.disabled)
          return {
            x: Math.round(left + width / 2),
            y: Math.round(top + height / 2),
            isPressed: button.getAttribute("aria-pressed") === "true",
          };
      }
      return null;
    },
    name,
  );
}

/** Click a button with the mouse. */
export async function clickButton(window: BrowserWindow, name: string): Promise<void> {
  const at = await waitForButton(window, name);
  await point(window, "mouse", ["move", at], ["down"], ["up"]);
}

/** Focus a button and press Enter. */
export async function pressButton(window: BrowserWindow, name: string): Promise<void> {
  await waitForButton(window, name);
  await evaluate(
    window,
    (name) => {
      for (const button of document.querySelectorAll("button"))
        if ((button.getAttribute("aria-label") ?? button.textContent?.trim()) === name) button.focus();
    },
    name,
  );
  await tapKey(window, ENTER);
}

/** Keys of the Actions API (W3C WebDriver, 17.4.2). */
export const [ENTER, SHIFT, CONTROL, ESCAPE] = ["\uE007", "\uE008", "\uE009", "\uE00C"];

/** Press a key and release it, while `modifier` is pressed if there is one. */
export function tapKey(window: BrowserWindow, key: string, modifier?: string): Promise<void> {
  const keys = modifier === undefined ? [key] : [modifier, key];
  return performKeys(window, [
    ...keys.map((value) => ({ type: "keyDown" as const, value })),
    ...keys.reverse().map((value) => ({ type: "keyUp" as const, value })),
  ]);
}

export function pressKey(window: BrowserWindow, value: string): Promise<void> {
  return performKeys(window, [{ type: "keyDown", value }]);
}

export function releaseKey(window: BrowserWindow, value: string): Promise<void> {
  return performKeys(window, [{ type: "keyUp", value }]);
}

function performKeys(window: BrowserWindow, actions: KeyAction[]): Promise<void> {
  return window.perform({ type: "key", id: "keyboard", actions });
}

/** Move, press and release a pointer. Coordinates are CSS pixels of the window. */
export async function point(
  window: BrowserWindow,
  pointerType: PointerType,
  ...steps: (["move", Point] | ["down"] | ["up"])[]
): Promise<void> {
  const actions = steps.map(([step, at]): PointerAction => {
    if (step === "move") return { type: "pointerMove", x: at.x, y: at.y };
    return { type: step === "down" ? "pointerDown" : "pointerUp", button: 0 };
  });
  await window.perform({ type: "pointer", id: pointerType, parameters: { pointerType }, actions });
}

/** Distance of the invitation from the hand (`ui/strings/name-tag.ts`). */
const INVITATION_DISTANCE_PX = 26;

/**
 * Return the place of the hand that a first visit is invited to take. The invitation stands on the side of the hand
 * that is turned away from the performer, who is in the middle of the window.
 */
export async function findHand(window: BrowserWindow): Promise<Point> {
  const hand = await waitFor(
    window,
    "the invitation to take a hand",
    (distance) => {
      const { invitation } = globalThis.window.probe;
      if (!invitation) return null;
      const { left, right, top, bottom } = invitation;
      const x = (left + right) / 2 > innerWidth / 2 ? left - distance : right + distance;
      return { x: Math.round(x), y: Math.round((top + bottom) / 2) };
    },
    INVITATION_DISTANCE_PX,
  );
  await waitForHand(window, hand);
  return hand;
}

/** Move the mouse to a place and wait until a hand can be taken there: one that was released takes time to return. */
export async function waitForHand(window: BrowserWindow, hand: Point): Promise<void> {
  await point(window, "mouse", ["move", hand]);
  await waitFor(
    window,
    "that the pointer can take the hand",
    () => getComputedStyle(document.querySelector("#stage") as Element).cursor === "grab",
  );
}

/** Wait until the page or an element has announced a text that contains `part`, and return how often it has. */
export function waitForAnnouncement(window: BrowserWindow, part: string): Promise<number> {
  return waitFor(
    window,
    `the message "${part}"`,
    (part) => globalThis.window.probe.announcements.filter((text) => text.includes(part)).length,
    part,
  );
}

/** Factor by which screenshots are reduced before they are compared: the quality of edges may change at any time. */
const REDUCTION = 6;

/**
 * Return the share of the stage that differs between two screenshots. It is the middle of the window: half of its
 * height and a third of its width.
 */
export function compareScreenshots(window: BrowserWindow, first: string, second: string): Promise<number> {
  return evaluate(
    window,
    async (reduction, ...screenshots) => {
      const [a, b] = await Promise.all(
        screenshots.map(async (screenshot) => {
          const bytes = Uint8Array.from(atob(screenshot), (letter) => letter.charCodeAt(0));
          const picture = await createImageBitmap(new Blob([bytes], { type: "image/png" }));
          const [width, height] = [picture.width / 3, picture.height / 2];
          const canvas = document.createElement("canvas");
          canvas.width = Math.round(width / reduction);
          canvas.height = Math.round(height / reduction);
          const context = canvas.getContext("2d") as CanvasRenderingContext2D;
          context.imageSmoothingQuality = "high";
          context.drawImage(picture, width, height / 2, width, height, 0, 0, canvas.width, canvas.height);
          return context.getImageData(0, 0, canvas.width, canvas.height).data;
        }),
      );
      let differing = 0;
      for (let at = 0; at < a.length; at += 4)
        if (Math.abs(a[at] - b[at]) + Math.abs(a[at + 1] - b[at + 1]) + Math.abs(a[at + 2] - b[at + 2]) > 48)
          differing++;
      return differing / (a.length / 4);
    },
    REDUCTION,
    first,
    second,
  );
}
