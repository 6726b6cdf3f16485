/** Short messages, read out politely: one at a time that is gone after a while and may offer something to do, and those that stand as long as what they tell of. */
import { element } from "../dom";
import { createLiveRegion } from "./live-region";

export interface ToastAction {
  label: string;
  /** The key that does the same, if there is one. */
  key?: string | null;
  run(): void;
}

export type ShowToast = (message: string, ...actions: readonly ToastAction[]) => void;

export interface ToastController extends ShowToast {
  /** Says that the line is lost until it is back, which null tells. */
  showDisconnected(message: string | null): void;
}

/** Milliseconds; with something to do there is more to read and to reach. */
const TOAST_DURATION_MS = 3_200;
const ACTION_TOAST_DURATION_MS = 8_000;

export function createToast(root: HTMLElement): ToastController {
  const live = element("div", { class: "toasts", role: "status", "aria-live": "polite", "aria-atomic": "false" });
  root.append(live);
  const stand = createLiveRegion<"line" | "moment">(live);
  let timer: ReturnType<typeof setTimeout> | undefined;
  const clear = () => stand("moment", null);
  const show: ShowToast = (message, ...actions) => {
    clearTimeout(timer);
    const toast = element("div", { class: "toast" }, message);
    for (const action of actions) {
      const act = () => {
        clear();
        action.run();
      };
      const button = element("button", { class: "toast-action", type: "button", onClick: act }, action.label);
      if (action.key) button.append(element("kbd", { class: "key-hint" }, action.key));
      toast.append(button);
    }
    stand("moment", toast);
    timer = setTimeout(clear, actions.length > 0 ? ACTION_TOAST_DURATION_MS : TOAST_DURATION_MS);
  };
  return Object.assign(show, {
    showDisconnected: (message: string | null) =>
      stand("line", message === null ? null : element("div", { class: "toast" }, message)),
  });
}
