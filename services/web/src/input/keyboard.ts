/** Everything by keyboard alone: what keys are bound to, and Escape and ? that are fixed. */
import type { Commands } from "./commands";
import { isHeld, isPadControl, type Mapping } from "./mapping";
import type { VelocityInputs } from "./velocity";

export interface KeyboardActions {
  /** Shows what the keys do. */
  keys(): void;
  /** Escape with nothing held: shut what is open. */
  escape(): void;
}

export function listenToKeyboard(target: Window, commands: Commands, velocity: VelocityInputs, mapping: () => Mapping, actions: KeyboardActions): void {
  target.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || typing(event.target) || document.querySelector("dialog[open]")) return;
    if (press(event)) event.preventDefault();
  });
  const press = (event: KeyboardEvent): boolean => {
    const { code } = event;
    if (commands.isDown(code)) {
      if (event.repeat) commands.repeat(code);
      return true;
    }
    if (event.repeat) return false;
    if (code === "Escape") {
      if (velocity.selected === null) actions.escape();
      for (let limb = 0; limb < 4; limb++) velocity.letGo(limb);
      return true;
    }
    if (event.key === "?") {
      actions.keys();
      return true;
    }
    const bound = mapping().bindings[code] ?? [];
    const held = bound.filter(isHeld);
    const meant = velocity.selected !== null && held.length > 0 ? held : bound.filter((command) => !isHeld(command));
    // a button or link that has the focus is pressed by these two
    const onControl = event.target instanceof Element && event.target.closest("button, a, [role=slider]") !== null;
    if (meant.length === 0 || (onControl && (code === "Space" || code === "Enter"))) return false;
    commands.press(code, meant, 1, event.timeStamp);
    return true;
  };
  target.addEventListener("keyup", (event) => commands.release(event.code, event.timeStamp));
  target.addEventListener("blur", () => commands.forget((control) => !isPadControl(control)));
}

function typing(target: EventTarget | null): boolean {
  return target instanceof HTMLElement && (target.isContentEditable || target.matches("input:not([type=range]), textarea, select"));
}
