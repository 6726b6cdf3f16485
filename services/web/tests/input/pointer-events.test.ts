import { expect, test } from "vitest";
import type { PointerMessage } from "../../src/input/pointer";
import { listenToPointer, showPointerState } from "../../src/input/pointer-events";

/** Canvas at (10, 20) of a page. */
class Canvas extends EventTarget {
  readonly captured: number[] = [];

  getBoundingClientRect() {
    return { left: 10, top: 20 };
  }

  setPointerCapture(pointer: number) {
    this.captured.push(pointer);
  }
}

class CanvasWithRawEvents extends Canvas {
  onpointerrawupdate = null;
}

function listen(canvas: Canvas) {
  const sent: string[] = [];
  const show = ({ kind, pointerId, x, y, now }: PointerMessage) => `${kind} ${pointerId} ${x},${y} at ${now}`;
  listenToPointer(canvas as unknown as HTMLCanvasElement, (message) => sent.push(show(message)));
  const dispatch = (type: string, pointerId: number, clientX: number, button = 0) => {
    const event = new Event(type);
    const fields = { pointerId, pointerType: "mouse", button, clientX, clientY: 25, timeStamp: clientX };
    for (const [name, value] of Object.entries(fields)) Object.defineProperty(event, name, { value });
    canvas.dispatchEvent(event);
  };
  return { sent, dispatch };
}

test("events are sent with the position on the canvas, and a press captures the pointer", () => {
  const canvas = new Canvas();
  const { sent, dispatch } = listen(canvas);
  dispatch("pointermove", 1, 11);
  dispatch("pointerdown", 1, 12);
  dispatch("pointermove", 1, 13);
  dispatch("pointercancel", 1, 14);
  dispatch("pointerleave", 1, 15);
  expect(sent).toEqual([
    "move 1 1,5 at 11",
    "down 1 2,5 at 12",
    "move 1 3,5 at 13",
    "up 1 4,5 at 14",
    "leave 1 5,5 at 15",
  ]);
  expect(canvas.captured).toEqual([1]);
});

test("movements of pressed pointers are sent before the frame, each once", () => {
  const { sent, dispatch } = listen(new CanvasWithRawEvents());
  const move = (pointer: number, x: number) => {
    dispatch("pointerrawupdate", pointer, x);
    dispatch("pointermove", pointer, x);
  };
  move(1, 11);
  dispatch("pointerdown", 1, 12);
  dispatch("pointerrawupdate", 1, 13);
  expect(sent).toEqual(["move 1 1,5 at 11", "down 1 2,5 at 12", "move 1 3,5 at 13"]);
  dispatch("pointermove", 1, 13);
  move(2, 14);
  dispatch("pointerup", 1, 15);
  move(1, 16);
  expect(sent.slice(3)).toEqual(["move 2 4,5 at 14", "up 1 5,5 at 15", "move 1 6,5 at 16"]);
});

test("a press of another button is sent, but captures nothing", () => {
  const canvas = new CanvasWithRawEvents();
  const { sent, dispatch } = listen(canvas);
  dispatch("pointerdown", 1, 12, 2);
  dispatch("pointerrawupdate", 1, 13);
  dispatch("pointermove", 1, 13);
  expect([sent, canvas.captured]).toEqual([["down 1 2,5 at 12", "move 1 3,5 at 13"], []]);
});

test("the canvas shows whether a pointer is near a handle or pulls one", () => {
  const attributes = new Set<string>();
  const canvas = {
    get dataset() {
      return Object.fromEntries([...attributes].map((name) => [name.replace("data-", ""), ""]));
    },
    toggleAttribute: (name: string, on: boolean) => void (on ? attributes.add(name) : attributes.delete(name)),
  } as unknown as HTMLElement;
  showPointerState(canvas, { isPointerNear: true, isPulling: false });
  expect([...attributes]).toEqual(["data-near"]);
  showPointerState(canvas, { isPointerNear: false, isPulling: true });
  expect([...attributes]).toEqual(["data-pulling"]);
});
