/** Pointer events of a canvas as messages for a `PointerInput`, and its state on the canvas for the style sheet. */
import type { PointerMessage } from "./pointer";

const KINDS = {
  pointerdown: "down",
  pointermove: "move",
  pointerup: "up",
  pointercancel: "up",
  pointerleave: "leave",
} as const;

/** Call `send` for every pointer event of `canvas`, which may be anywhere in the page. */
export function listenToPointer(canvas: HTMLCanvasElement, send: (message: PointerMessage) => void): void {
  for (const [type, kind] of Object.entries(KINDS) as [keyof typeof KINDS, PointerMessage["kind"]][]) {
    canvas.addEventListener(type, ({ pointerId, pointerType, button, clientX, clientY, timeStamp: now }) => {
      const { left, top } = canvas.getBoundingClientRect();
      if (kind === "down" && button === 0) canvas.setPointerCapture(pointerId);
      send({ kind, pointerId, pointerType, button, x: clientX - left, y: clientY - top, now });
    });
  }
}

/** Show on the canvas whether a pointer is near a handle, and whether one is dragged. */
export function showPointerState(
  canvas: HTMLElement,
  { isPointerNear, isPulling }: { readonly isPointerNear: boolean; readonly isPulling: boolean },
): void {
  if ("near" in canvas.dataset !== isPointerNear) canvas.toggleAttribute("data-near", isPointerNear);
  if ("pulling" in canvas.dataset !== isPulling) canvas.toggleAttribute("data-pulling", isPulling);
}
