/** One short message at a time, read out politely, gone after a while. */
import { element } from "./dom";

export type Toast = (message: string) => void;

export function createToast(root: HTMLElement, lasting = 3200): Toast {
  const live = element("div", { role: "status", "aria-live": "polite" });
  root.append(live);
  let timer: ReturnType<typeof setTimeout> | undefined;
  return (message) => {
    clearTimeout(timer);
    live.replaceChildren(element("div", { class: "toast" }, message));
    timer = setTimeout(() => live.replaceChildren(), lasting);
  };
}
