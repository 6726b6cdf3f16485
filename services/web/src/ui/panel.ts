/** Panels for library, strings and connection. On a phone they are sheets, of which one is open at a time. */
import { translate } from "../i18n/translator";
import { element } from "./dom";
import { icon } from "./icon";
import type { PanelName } from "./transport/transport";
import { DOCK_WIDTH_PX, LANDSCAPE_DOCK_WIDTH_PX, LANDSCAPE_PHONE, PHONE } from "./window-shape";

export interface Panel {
  readonly element: HTMLElement;
  readonly body: HTMLElement;
}

/** Create a hidden panel with a title, already translated, and a close button. */
export function createPanel(root: HTMLElement, kind: string, title: string, onClose: () => void): Panel {
  const body = element("div");
  const closeButton = element(
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
    element("div", { class: "panel-head" }, element("h2", {}, title), closeButton),
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
  /** Close the panel that was opened last. Returns false if none is open. */
  closeLast(): boolean;
  /** True if a sheet covers the lower part of a phone, or its right side in landscape. */
  readonly isSheetOpen: boolean;
  /** Width in pixels that panels, or the dock, cover at the left and right of a desktop or a landscape phone. */
  readonly sideInsets: readonly [left: number, right: number];
  /** Height in pixels that a sheet covers at the bottom of a portrait phone. */
  readonly bottomInset: number;
}

/** Width of a panel with its margins. */
const PANEL_WIDTH_PX = 356;
/** Widths on a landscape phone, where a sheet has a maximum share of the window's width (`style/sideways.css`). */
const [SHEET_MAX_WIDTH_PX, SHEET_MAX_WIDTH_SHARE] = [340, 0.56];
/** Smallest windows with space for panels at both sides, and for two panels at the right, one above the other. */
const [TWO_SIDES_MIN_WIDTH_PX, TWO_PANELS_MIN_HEIGHT_PX] = [900, 740];

/**
 * Manage which panels are open. `onToggle` is called for every panel that opens or closes, `onResize` when one changes
 * its size. Closing a panel returns the focus to the element that opened it.
 */
export function createPanels(
  panels: ReadonlyMap<PanelName, HTMLElement>,
  onToggle: (name: PanelName, open: boolean) => void,
  onResize: () => void,
): Panels {
  const sizes = new ResizeObserver(onResize);
  for (const panel of panels.values()) sizes.observe(panel);
  const order: PanelName[] = [];
  const openers = new Map<PanelName, HTMLElement>();
  const set = (name: PanelName, open: boolean) => {
    const panel = panels.get(name);
    if (!panel || panel.hidden !== open) return;
    const focused = document.activeElement;
    const hadFocus = panel.contains(focused);
    panel.hidden = !open;
    order.splice(0, order.length, ...order.filter((other) => other !== name));
    if (open) {
      for (const other of [...order]) if (!fitBeside(name, other)) set(other, false);
      order.push(name);
      if (focused instanceof HTMLElement && focused !== document.body) openers.set(name, focused);
    }
    document.body.classList.toggle("sheet-open", PHONE.matches && order.length > 0);
    if (!open && hadFocus) openers.get(name)?.focus();
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
      const insetOf = (...names: PanelName[]) =>
        names.some((name) => order.includes(name)) ? PANEL_WIDTH_PX : DOCK_WIDTH_PX;
      return [insetOf("library"), insetOf("strings", "line")] as const;
    },
  };
}

/** Return whether the window has space for both panels. */
function fitBeside(name: PanelName, other: PanelName): boolean {
  if (PHONE.matches) return false;
  return (name === "library") === (other === "library")
    ? innerHeight >= TWO_PANELS_MIN_HEIGHT_PX
    : innerWidth >= TWO_SIDES_MIN_WIDTH_PX;
}
