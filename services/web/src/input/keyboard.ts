/** Everything by keyboard alone: limbs, their movement, playing, seeking and the panels. */
import type { Hands } from "./hands";
import { directionOf, isDirection, limbOf } from "./keys";

/** A key held longer than this lets its limb go when it comes up; a shorter press leaves the limb held. Milliseconds. */
const LONG_PRESS = 400;

export interface KeyboardActions {
  /** Asks for a limb on behalf of the keys; false when it cannot be had. */
  take(limb: number): boolean;
  play(): void;
  /** Seeks by so many blocks. */
  step(blocks: number): void;
  panel(name: "library" | "strings" | "line"): void;
  keys(): void;
  /** Escape with nothing held: shut what is open. */
  escape(): void;
}

const PANELS = { KeyL: "library", KeyS: "strings", KeyN: "line" } as const;

export interface KeyboardInput {
  /** The limb that the keys move; null for none. */
  readonly limb: number | null;
  /** Sends the speed of the keys held down. Once a frame. */
  update(): void;
}

export function createKeyboard(target: Window, hands: Hands, actions: KeyboardActions): KeyboardInput {
  const down = new Set<string>();
  const pressed = new Map<number, { at: number; fresh: boolean }>();
  let limb: number | null = null;

  /** The limb taken last that the keys still hold. */
  const current = () => {
    if (limb !== null && hands.source(limb) !== "keys") limb = [0, 1, 2, 3].find((one) => hands.source(one) === "keys") ?? null;
    return limb;
  };
  target.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || typing(event.target) || document.querySelector("dialog[open]")) return;
    const chosen = limbOf(event.code);
    if (chosen !== null) {
      event.preventDefault();
      if (event.repeat) return;
      const fresh = hands.source(chosen) === null;
      if (fresh && !actions.take(chosen)) return;
      if (!fresh && hands.source(chosen) !== "keys") return;
      pressed.set(chosen, { at: event.timeStamp, fresh });
      limb = chosen;
      return;
    }
    if (isDirection(event.code) && current() !== null) {
      event.preventDefault();
      down.add(event.code);
      return;
    }
    if (command(event)) event.preventDefault();
  });
  const command = (event: KeyboardEvent): boolean => {
    const { code } = event;
    const onControl = event.target instanceof Element && event.target.closest("button, a, [role=slider]") !== null;
    if (code === "Escape") {
      if (current() === null) actions.escape();
      for (let one = 0; one < 4; one++) if (hands.source(one) === "keys") hands.letGo(one);
    } else if (code === "Space") {
      if (onControl || event.repeat) return false;
      actions.play();
    } else if (code === "ArrowLeft" || code === "ArrowRight") {
      actions.step(code === "ArrowLeft" ? -1 : 1);
    } else if (event.key === "?" && !event.repeat) {
      actions.keys();
    } else if (code in PANELS && !event.repeat) {
      actions.panel(PANELS[code as keyof typeof PANELS]);
    } else {
      return false;
    }
    return true;
  };
  target.addEventListener("keyup", (event) => {
    down.delete(event.code);
    const chosen = limbOf(event.code);
    const press = chosen === null ? undefined : pressed.get(chosen);
    if (chosen === null || !press) return;
    pressed.delete(chosen);
    const long = event.timeStamp - press.at > LONG_PRESS;
    // A tap takes and the next tap lets go; a long press holds for as long as it lasts.
    if ((long || !press.fresh) && hands.source(chosen) === "keys") hands.letGo(chosen);
  });
  target.addEventListener("blur", () => down.clear());
  return {
    get limb() {
      return current();
    },
    update() {
      const now = current();
      for (let one = 0; one < 4; one++) {
        if (hands.source(one) === "keys") hands.move(one, ...(one === now ? directionOf(down) : ([0, 0, 0] as const)));
      }
    },
  };
}

function typing(target: EventTarget | null): boolean {
  return target instanceof HTMLElement && (target.isContentEditable || target.matches("input:not([type=range]), textarea, select"));
}
