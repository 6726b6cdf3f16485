/**
 * Additional mouse buttons and the wheel on the stage, with their bindings. The primary button drags and turns
 * (`pointer.ts`).
 */
import type { CommandInput } from "./command-dispatcher";
import type { Control, Mapping } from "./mapping";

/** Duration of the press that a notch of the wheel stands for, in milliseconds. */
const WHEEL_NOTCH_MS = 120;

/** Return the control of a mouse event, or null for the primary button. */
export function controlOfEvent(event: MouseEvent): Control | null {
  if (event.type === "wheel") {
    // With Ctrl the event is the browser's zoom or a touchpad pinch.
    const { deltaY } = event as WheelEvent;
    return deltaY === 0 || event.ctrlKey ? null : `wheel:${deltaY > 0 ? "+" : "-"}`;
  }
  return event.button > 0 && event.button <= 4 ? `mouse:${event.button}` : null;
}

export function listenToMouse(
  canvas: HTMLElement,
  window: EventTarget,
  commands: CommandInput,
  mapping: () => Mapping,
): void {
  let wheelTimer: ReturnType<typeof setTimeout> | undefined;
  let wheelControl: Control | null = null;
  const press = (event: MouseEvent): Control | null => {
    const control = controlOfEvent(event);
    const bound = control === null ? undefined : mapping().bindings[control];
    if (control === null || !bound) return null;
    if (commands.press(control, bound, 1, event.timeStamp)) event.preventDefault();
    return commands.isDown(control) ? control : null;
  };
  const releaseWheel = (now: number) => {
    clearTimeout(wheelTimer);
    if (wheelControl) commands.release(wheelControl, now);
    wheelControl = null;
  };
  canvas.addEventListener("mousedown", press);
  window.addEventListener("mouseup", (event) => {
    const control = controlOfEvent(event as MouseEvent);
    if (control) commands.release(control, event.timeStamp);
  });
  canvas.addEventListener(
    "wheel",
    (event) => {
      if (wheelControl && wheelControl !== controlOfEvent(event)) releaseWheel(event.timeStamp);
      wheelControl = press(event) ?? wheelControl;
      clearTimeout(wheelTimer);
      wheelTimer = setTimeout(() => releaseWheel(event.timeStamp + WHEEL_NOTCH_MS), WHEEL_NOTCH_MS);
    },
    { passive: false },
  );
  canvas.addEventListener("contextmenu", (event) => {
    if (mapping().bindings["mouse:2"]) event.preventDefault();
  });
}
