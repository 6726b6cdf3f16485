/** Position of messages: at the top of the page, or at the bottom while a performer's face is at the top. */
import { overlaps, type ScreenBox } from "../../stage/camera/screen-box";
import { element, setAttribute } from "../dom";

export interface MessageArea {
  readonly element: HTMLElement;
  /** Keep clear of the performers' faces, given as CSS pixel boxes. Call this whenever they have moved. */
  avoidFaces(faces: readonly ScreenBox[]): void;
}

/** Distance that a new message keeps from a face, since faces move. */
const FACE_MARGIN_PX = 20;

/**
 * Create the message area. `onMove` is called when it changes its position. `notice` is shown in it while faces are on
 * the stage, else in the middle of the stage.
 */
export function createMessageArea(root: HTMLElement, notice: HTMLElement, onMove: () => void): MessageArea {
  const messages = element("div", { class: "messages" });
  root.append(messages);
  /** Boxes of the messages at the top and at the bottom; null while there are none. */
  let positions: readonly [top: ScreenBox, bottom: ScreenBox] | null = null;
  let faces: readonly ScreenBox[] = [];
  let atBottom = false;
  const moveTo = (bottom: boolean) => {
    atBottom = bottom;
    setAttribute(messages, "data-low", atBottom);
    onMove();
  };
  const measure = () => {
    const isNew = positions === null;
    if (messages.offsetHeight === 0) {
      positions = null;
      if (atBottom) moveTo(false);
      return;
    }
    const measureAt = (bottom: boolean) => {
      setAttribute(messages, "data-low", bottom);
      return messages.getBoundingClientRect();
    };
    positions = [measureAt(false), measureAt(true)];
    setAttribute(messages, "data-low", atBottom);
    choose(isNew);
  };
  const choose = (isNew = false) => {
    if (positions && belongsAtBottom(atBottom, positions, faces, isNew) !== atBottom) moveTo(!atBottom);
  };
  new ResizeObserver(measure).observe(messages);
  addEventListener("resize", measure);
  return {
    element: messages,
    avoidFaces(current) {
      faces = current;
      const parent = current.length > 0 ? messages : root;
      if (notice.parentElement !== parent) parent.append(notice);
      choose();
    },
  };
}

/**
 * Return whether messages belong at the bottom rather than the top. They stay where they are unless they cover a face
 * there and would not on the other side. New messages also keep a margin to faces, since faces move.
 */
export function belongsAtBottom(
  atBottom: boolean,
  [top, bottom]: readonly [top: ScreenBox, bottom: ScreenBox],
  faces: readonly ScreenBox[],
  isNew = false,
): boolean {
  const [current, other] = atBottom ? [bottom, top] : [top, bottom];
  const covers = (box: ScreenBox, margin: number) => faces.some((face) => overlaps(box, face, margin));
  const shouldMove = (margin: number) => covers(current, margin) && !covers(other, margin);
  return shouldMove(0) || (isNew && shouldMove(FACE_MARGIN_PX)) ? !atBottom : atBottom;
}
