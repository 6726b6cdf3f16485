/** Everything by keyboard alone: what keys are bound to, and Escape and ? that are fixed. */
import type { CommandDispatcher } from "./command-dispatcher";
import { isPadControl, type Mapping } from "./mapping";
import type { VelocityInputs } from "./velocity-input";

export interface KeyboardActions {
  /** Shows what the keys do. */
  showKeys(): void;
  /** Escape with nothing held: shut what is open. */
  onEscape(): void;
}

/** Listens to the keys of a window, or of an element that has the focus or something in it that has. */
export function listenToKeyboard(
  target: GlobalEventHandlers,
  commands: CommandDispatcher,
  velocity: VelocityInputs,
  mapping: () => Mapping,
  actions: KeyboardActions,
): void {
  target.addEventListener("keydown", (event) => {
    if (
      event.ctrlKey ||
      event.metaKey ||
      event.altKey ||
      isTextField(event.target) ||
      document.querySelector("dialog[open]")
    )
      return;
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
      if (!velocity.releaseAll()) actions.onEscape();
      return true;
    }
    if (event.key === "?") {
      actions.showKeys();
      return true;
    }
    // a button or link that has the focus is pressed by these two
    const onControl = event.target instanceof Element && event.target.closest("button, a, [role=slider]") !== null;
    if (onControl && (code === "Space" || code === "Enter")) return false;
    return commands.press(code, mapping().bindings[code] ?? [], 1, event.timeStamp);
  };
  target.addEventListener("keyup", (event) => commands.release(event.code, event.timeStamp));
  target.addEventListener("tagName" in target ? "focusout" : "blur", () =>
    commands.releaseAll((control) => !isPadControl(control)),
  );
}

function isTextField(target: EventTarget | null): boolean {
  return (
    target instanceof HTMLElement &&
    (target.isContentEditable || target.matches("input:not([type=range]), textarea, select"))
  );
}
