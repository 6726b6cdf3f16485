/** Viewport of the stage: the window, and the parts of it that panels cover. */
import type { Viewport } from "../engine/message";
import type { Panels } from "../ui/panel";
import { DOCK_WIDTH_PX, LANDSCAPE_DOCK_WIDTH_PX, LANDSCAPE_PHONE, PHONE } from "../ui/window-shape";

/**
 * Return the viewport beside the panels that are open. `panels` is null before there are any. `isAlone` is true if the
 * stage is shown without the page around it.
 */
export function describeViewport(
  isAlone: boolean,
  panels: Pick<Panels, "isSheetOpen" | "sideInsets" | "bottomInset"> | null,
): Viewport {
  const framing = isAlone
    ? "alone"
    : LANDSCAPE_PHONE.matches
      ? "sideways"
      : !PHONE.matches
        ? "desktop"
        : panels?.isSheetOpen
          ? "sheet"
          : "phone";
  return {
    width: innerWidth,
    height: innerHeight,
    framing,
    pixelRatio: devicePixelRatio,
    sideInsets: framing === "desktop" || framing === "sideways" ? (panels?.sideInsets ?? dockInsets()) : [0, 0],
    bottomInset: isAlone ? 0 : (panels?.bottomInset ?? 0),
  };
}

/** Return the widths that the page covers at the left and right without open panels. */
function dockInsets(): readonly [number, number] {
  return LANDSCAPE_PHONE.matches ? [0, LANDSCAPE_DOCK_WIDTH_PX] : [DOCK_WIDTH_PX, DOCK_WIDTH_PX];
}
