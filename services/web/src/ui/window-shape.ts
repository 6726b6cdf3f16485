/** Shapes of the window that the page is laid out for, and what the page covers of it without open panels. */

/** Phone in landscape: the window is so low that panels cover its right side. */
const LANDSCAPE_PHONE_QUERY = "(max-height: 460px) and (orientation: landscape)";
export const LANDSCAPE_PHONE = matchMedia(LANDSCAPE_PHONE_QUERY);
/** Windows in which panels are sheets. */
export const PHONE = matchMedia(`(max-width: 720px), ${LANDSCAPE_PHONE_QUERY}`);

/** Widths of the dock with its margins; with part of its names on a desktop (art direction, section 6). */
export const DOCK_WIDTH_PX = 96;
export const LANDSCAPE_DOCK_WIDTH_PX = 112;
