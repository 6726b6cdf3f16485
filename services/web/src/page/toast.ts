/** One short message at a time, read out politely, gone after a while; it may offer something to do. */
import { element } from "./dom";

export interface ToastAction {
  label: string;
  /** The key that does the same, if there is one. */
  key?: string | null;
  act(): void;
}

export type Toast = (message: string, ...actions: readonly ToastAction[]) => void;

/** Milliseconds; with something to do there is more to read and to reach. */
const LASTING = 3_200;
const OFFERED = 8_000;

export function createToast(root: HTMLElement): Toast {
  const live = element("div", { role: "status", "aria-live": "polite" });
  root.append(live);
  let timer: ReturnType<typeof setTimeout> | undefined;
  const clear = () => live.replaceChildren();
  return (message, ...actions) => {
    clearTimeout(timer);
    const toast = element("div", { class: "toast" }, message);
    for (const action of actions) {
      const act = () => {
        clear();
        action.act();
      };
      const button = element("button", { class: "toast-action", type: "button", onClick: act }, action.label);
      if (action.key) button.append(element("kbd", { class: "key-hint" }, action.key));
      toast.append(button);
    }
    live.replaceChildren(toast);
    timer = setTimeout(clear, actions.length > 0 ? OFFERED : LASTING);
  };
}
