/** Toasts: one short message at a time, which may offer actions, and one for as long as the connection is lost. */
import { element } from "../dom";
import { createLiveRegion } from "./live-region";

export interface ToastAction {
  label: string;
  /** Name of the key that does the same, if there is one. */
  key?: string | null;
  run(): void;
}

export type ShowToast = (message: string, ...actions: readonly ToastAction[]) => void;

export interface ToastController extends ShowToast {
  /** Show that the connection is lost; null hides the message. */
  showDisconnected(message: string | null): void;
}

/** Shortest duration, time for each character of a long text, and duration with actions, which take time to reach. */
const TOAST_DURATION_MS = 3_200;
const READING_MS_PER_CHARACTER = 60;
const ACTION_TOAST_DURATION_MS = 8_000;

export function createToast(root: HTMLElement): ToastController {
  const live = element("div", { class: "toasts", role: "status", "aria-live": "polite", "aria-atomic": "false" });
  root.append(live);
  const setMessage = createLiveRegion<"connection" | "toast">(live);
  let timer: ReturnType<typeof setTimeout> | undefined;
  const clear = () => setMessage("toast", null);
  const show: ShowToast = (message, ...actions) => {
    clearTimeout(timer);
    const toast = element("div", { class: "toast" }, message);
    for (const action of actions) {
      const onClick = () => {
        clear();
        action.run();
      };
      const button = element("button", { class: "toast-action", type: "button", onClick }, action.label);
      if (action.key) button.append(element("kbd", { class: "key-hint" }, action.key));
      toast.append(button);
    }
    setMessage("toast", toast);
    const minimum = actions.length > 0 ? ACTION_TOAST_DURATION_MS : TOAST_DURATION_MS;
    timer = setTimeout(clear, Math.max(minimum, message.length * READING_MS_PER_CHARACTER));
  };
  return Object.assign(show, {
    showDisconnected: (message: string | null) =>
      setMessage("connection", message === null ? null : element("div", { class: "toast" }, message)),
  });
}
