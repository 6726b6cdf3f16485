/** Opens and shuts the library, strings and line panels; on a phone one at a time, as a sheet. */
import { element } from "./dom";
import { icon } from "./icons";
import type { PanelName } from "./transport";
import { say } from "../words/say";

/** A phone on its side: the window is so low that panels stand at its right, before all else. */
const SIDE = "(max-height: 460px) and (orientation: landscape)";
export const SIDEWAYS = matchMedia(SIDE);
/** Panels are sheets, one at a time. */
export const PHONE = matchMedia(`(max-width: 720px), ${SIDE}`);

export interface Panel {
  readonly element: HTMLElement;
  readonly body: HTMLElement;
}

/** A panel with its title, as it is said, and close button. */
export function createPanel(root: HTMLElement, kind: string, title: string, close: () => void): Panel {
  const body = element("div");
  const shut = element("button", { class: "round-button", type: "button", "aria-label": say("Close {panel}", { panel: title.toLowerCase() }), onClick: close }, icon("close"));
  const panel = element("aside", { class: `panel ${kind}`, "aria-label": title, hidden: true }, element("div", { class: "panel-head" }, element("h2", {}, title), shut), body);
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
  readonly sheet: boolean;
  /** Pixels of a desktop, or of a phone on its side, that panels or the dock in their place take to the left and to the right. */
  readonly sides: readonly [left: number, right: number];
  /** Pixels of a phone that a sheet takes from below. */
  readonly below: number;
}

/** What a panel takes with its margin, and the dock with its own and some of the names beside it, pixels (art direction, section 6). */
const PANEL = 356;
const DOCK = 96;
/** The same of a phone on its side, where a sheet is no wider than a share of the window (`style/sideways.css`). */
const [SHEET, SHEET_SHARE] = [340, 0.56];
const SIDE_DOCK = 112;

/** `changed` is told of every panel that opens or shuts, and `grown` where one has another size. The button that opened a panel gets the focus back. */
export function createPanels(panels: ReadonlyMap<PanelName, HTMLElement>, changed: (name: PanelName, open: boolean) => void, grown: () => void): Panels {
  const sizes = new ResizeObserver(grown);
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
    changed(name, open);
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
    get sheet() {
      return PHONE.matches && order.length > 0;
    },
    get below() {
      return PHONE.matches && !SIDEWAYS.matches ? Math.max(0, ...order.map((name) => panels.get(name)?.offsetHeight ?? 0)) : 0;
    },
    get sides() {
      if (SIDEWAYS.matches) return [0, order.length > 0 ? Math.min(SHEET, SHEET_SHARE * innerWidth) : SIDE_DOCK] as const;
      const taken = (...names: PanelName[]) => (names.some((name) => order.includes(name)) ? PANEL : DOCK);
      return [taken("library"), taken("strings", "line")] as const;
    },
  };
}
