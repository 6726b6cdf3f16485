/** The mouse's further buttons and its wheel on the stage: what they are bound to. The first button drags and turns (`pointer.ts`). */
import type { CommandDispatcher } from "./command-dispatcher";
import type { Control, Mapping } from "./mapping";

/** A notch of the wheel counts as a press of this length, milliseconds. */
const WHEEL_NOTCH_MS = 120;

/** The control of a mouse event, or null: the first button is none. */
export function controlOfEvent(event: MouseEvent): Control | null {
  if (event.type === "wheel") {
    // with Ctrl it is the browser's, and a pinch of a touchpad
    const { deltaY } = event as WheelEvent;
    return deltaY === 0 || event.ctrlKey ? null : `wheel:${deltaY > 0 ? "+" : "-"}`;
  }
  return event.button > 0 && event.button <= 4 ? `mouse:${event.button}` : null;
}

export function listenToMouse(
  canvas: HTMLElement,
  window: EventTarget,
  commands: CommandDispatcher,
  mapping: () => Mapping,
): void {
  let turning: ReturnType<typeof setTimeout> | undefined;
  let turned: Control | null = null;
  const press = (event: MouseEvent): Control | null => {
    const control = controlOfEvent(event);
    const bound = control === null ? undefined : mapping().bindings[control];
    if (control === null || !bound || !commands.press(control, bound, 1, event.timeStamp)) return null;
    event.preventDefault();
    return control;
  };
  const rest = (now: number) => {
    clearTimeout(turning);
    if (turned) commands.release(turned, now);
    turned = null;
  };
  canvas.addEventListener("mousedown", press);
  window.addEventListener("mouseup", (event) => {
    const control = controlOfEvent(event as MouseEvent);
    if (control) commands.release(control, event.timeStamp);
  });
  canvas.addEventListener(
    "wheel",
    (event) => {
      if (turned && turned !== controlOfEvent(event)) rest(event.timeStamp);
      turned = press(event) ?? turned;
      clearTimeout(turning);
      turning = setTimeout(() => rest(event.timeStamp + WHEEL_NOTCH_MS), WHEEL_NOTCH_MS);
    },
    { passive: false },
  );
  canvas.addEventListener("contextmenu", (event) => {
    if (mapping().bindings["mouse:2"]) event.preventDefault();
  });
}
