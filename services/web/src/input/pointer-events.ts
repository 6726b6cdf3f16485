/** Pointer events of a canvas as messages for a `PointerInput`, and its state on the canvas for the style sheet. */
import type { PointerMessage } from "./pointer";

const KINDS = {
  pointerdown: "down",
  pointermove: "move",
  pointerup: "up",
  pointercancel: "up",
  pointerleave: "leave",
} as const;

/**
 * Call `send` for every pointer event of `canvas`, which may be anywhere in the page. Movements of a pressed pointer
 * are sent as soon as they arrive, where the browser reports them before its next frame (Pointer Events 3, 4.1.3.2).
 */
export function listenToPointer(canvas: HTMLCanvasElement, send: (message: PointerMessage) => void): void {
  const sendAs = (kind: PointerMessage["kind"], event: PointerEvent) => {
    const { pointerId, pointerType, button, clientX, clientY, timeStamp: now } = event;
    const { left, top } = canvas.getBoundingClientRect();
    send({ kind, pointerId, pointerType, button, x: clientX - left, y: clientY - top, now });
  };
  const pressed = new Set<number>();
  const sendRaw = (event: Event) => {
    if (pressed.has((event as PointerEvent).pointerId)) sendAs("move", event as PointerEvent);
  };
  const hasRawEvents = "onpointerrawupdate" in canvas;
  for (const [type, kind] of Object.entries(KINDS) as [keyof typeof KINDS, PointerMessage["kind"]][]) {
    canvas.addEventListener(type, (event) => {
      const { pointerId, button } = event;
      if (kind === "move" && hasRawEvents && pressed.has(pointerId)) return;
      if (kind === "down" && button === 0) {
        canvas.setPointerCapture(pointerId);
        pressed.add(pointerId);
        // Only while it is needed: browsers report them up to a thousand times per second.
        canvas.addEventListener("pointerrawupdate", sendRaw);
      } else if (kind === "up") {
        pressed.delete(pointerId);
        if (pressed.size === 0) canvas.removeEventListener("pointerrawupdate", sendRaw);
      }
      sendAs(kind, event);
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
