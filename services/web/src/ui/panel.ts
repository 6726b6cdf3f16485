/** Opens and shuts the library, strings and line panels; on a phone one at a time, as a sheet. */

import { translate } from "../i18n/translator";
import { element } from "./dom";
import { icon } from "./icon";
import type { PanelName } from "./transport/transport";

/** A phone on its side: the window is so low that panels stand at its right, before all else. */
const LANDSCAPE_PHONE_QUERY = "(max-height: 460px) and (orientation: landscape)";
export const LANDSCAPE_PHONE = matchMedia(LANDSCAPE_PHONE_QUERY);
/** Panels are sheets, one at a time. */
export const PHONE = matchMedia(`(max-width: 720px), ${LANDSCAPE_PHONE_QUERY}`);

export interface Panel {
  readonly element: HTMLElement;
  readonly body: HTMLElement;
}

/** A panel with its title, as it is said, and close button. */
export function createPanel(root: HTMLElement, kind: string, title: string, onClose: () => void): Panel {
  const body = element("div");
  const shut = element(
    "button",
    {
      class: "round-button",
      type: "button",
      "aria-label": translate("Close {panel}", { panel: title.toLowerCase() }),
      onClick: onClose,
    },
    icon("close"),
  );
  const panel = element(
    "aside",
    { class: `panel ${kind}`, "aria-label": title, hidden: true },
    element("div", { class: "panel-head" }, element("h2", {}, title), shut),
    body,
  );
  root.append(panel);
  return { element: panel, body };
}

export interface Panels {
  isOpen(name: PanelName): boolean;
  toggle(name: PanelName): void;
  open(name: PanelName): void;
  close(name: PanelName): void;
  /** Shuts the panel opened last; false when none is open. */
  closeLast(): boolean;
  /** Some panel covers the lower part of a phone, or the right of one on its side. */
  readonly isSheetOpen: boolean;
  /** Pixels of a desktop, or of a phone on its side, that panels or the dock in their place take to the left and to the right. */
  readonly sideInsets: readonly [left: number, right: number];
  /** Pixels of a phone that a sheet takes from below. */
  readonly bottomInset: number;
}

/** What a panel takes with its margin, and the dock with its own and some of the names beside it, pixels (art direction, section 6). */
const PANEL_WIDTH_PX = 356;
const DOCK_WIDTH_PX = 96;
/** The same of a phone on its side, where a sheet is no wider than a share of the window (`style/sideways.css`). */
const [SHEET_MAX_WIDTH_PX, SHEET_MAX_WIDTH_SHARE] = [340, 0.56];
const LANDSCAPE_DOCK_WIDTH_PX = 112;

/** `changed` is told of every panel that opens or shuts, and `grown` where one has another size. The button that opened a panel gets the focus back. */
export function createPanels(
  panels: ReadonlyMap<PanelName, HTMLElement>,
  onToggle: (name: PanelName, open: boolean) => void,
  onResize: () => void,
): Panels {
  const sizes = new ResizeObserver(onResize);
  for (const panel of panels.values()) sizes.observe(panel);
  const order: PanelName[] = [];
  const returns = new Map<PanelName, HTMLElement>();
  const set = (name: PanelName, open: boolean) => {
    const panel = panels.get(name);
    if (!panel || panel.hidden !== open) return;
    const before = document.activeElement;
    const within = panel.contains(before);
    panel.hidden = !open;
    order.splice(0, order.length, ...order.filter((one) => one !== name));
    if (open) {
      if (PHONE.matches) for (const other of [...order]) set(other, false);
      order.push(name);
      if (before instanceof HTMLElement && before !== document.body) returns.set(name, before);
    }
    document.body.classList.toggle("sheet-open", PHONE.matches && order.length > 0);
    if (!open && within) returns.get(name)?.focus();
    onToggle(name, open);
  };
  return {
    isOpen: (name) => order.includes(name),
    toggle(name) {
      set(name, !order.includes(name));
    },
    open: (name) => set(name, true),
    close: (name) => set(name, false),
    closeLast() {
      const last = order.at(-1);
      if (last) set(last, false);
      return last !== undefined;
    },
    get isSheetOpen() {
      return PHONE.matches && order.length > 0;
    },
    get bottomInset() {
      return PHONE.matches && !LANDSCAPE_PHONE.matches
        ? Math.max(0, ...order.map((name) => panels.get(name)?.offsetHeight ?? 0))
        : 0;
    },
    get sideInsets() {
      if (LANDSCAPE_PHONE.matches)
        return [
          0,
          order.length > 0 ? Math.min(SHEET_MAX_WIDTH_PX, SHEET_MAX_WIDTH_SHARE * innerWidth) : LANDSCAPE_DOCK_WIDTH_PX,
        ] as const;
      const taken = (...names: PanelName[]) =>
        names.some((name) => order.includes(name)) ? PANEL_WIDTH_PX : DOCK_WIDTH_PX;
      return [taken("library"), taken("strings", "line")] as const;
    },
  };
}
