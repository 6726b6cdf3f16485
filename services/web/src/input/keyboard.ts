/** Keyboard input: the bound keys, and the fixed keys Escape and ?. */
import type { CommandInput } from "./command-dispatcher";
import { isPadControl, type Mapping } from "./mapping";

export interface KeyboardActions {
  /** Show the key bindings. */
  showKeys(): void;
  /** Close the open panel, on Escape with no limb held. */
  onEscape(): void;
}

/**
 * Listen to the keys of a window, or of an element that contains the focus. `limbs` releases all held limbs and returns
 * whether there were any.
 */
export function listenToKeyboard(
  target: GlobalEventHandlers,
  commands: CommandInput,
  limbs: { releaseAll(): boolean },
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
    if (commands.isDown(code)) return event.repeat ? commands.repeat(code) : true;
    if (event.repeat) return false;
    if (code === "Escape") {
      if (!limbs.releaseAll()) actions.onEscape();
      return true;
    }
    if (event.key === "?") {
      actions.showKeys();
      return true;
    }
    // These two keys activate a focused button or link.
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
