/** Where what is said stands: at the head of the page, and at its foot where a face is there. */
import { overlaps, type ScreenBox } from "../../stage/camera/screen-box";
import { element, setAttribute } from "../dom";

export interface MessageArea {
  readonly element: HTMLElement;
  /** Keeps clear of the faces of those who dance, CSS pixels: told of every frame. */
  avoidFaces(faces: readonly ScreenBox[]): void;
}

/** Pixels to a face, that will move. */
const FACE_MARGIN_PX = 20;

/** `moved` is told when they have another place. While somebody dances the `notice` stands among them, else in the middle of the stage. */
export function createMessageArea(root: HTMLElement, notice: HTMLElement, onMove: () => void): MessageArea {
  const messages = element("div", { class: "messages" });
  root.append(messages);
  /** The boxes at the head and at the foot; null while nothing is said. */
  let places: readonly [head: ScreenBox, foot: ScreenBox] | null = null;
  let faces: readonly ScreenBox[] = [];
  let low = false;
  const put = (to: boolean) => {
    low = to;
    setAttribute(messages, "data-low", low);
    onMove();
  };
  const measure = () => {
    const first = places === null;
    if (messages.offsetHeight === 0) {
      places = null;
      if (low) put(false);
      return;
    }
    const box = (at: boolean) => {
      setAttribute(messages, "data-low", at);
      return messages.getBoundingClientRect();
    };
    places = [box(false), box(true)];
    setAttribute(messages, "data-low", low);
    choose(first);
  };
  const choose = (first = false) => {
    if (places && belongsAtBottom(low, places, faces, first) !== low) put(!low);
  };
  new ResizeObserver(measure).observe(messages);
  addEventListener("resize", measure);
  return {
    element: messages,
    avoidFaces(now) {
      faces = now;
      const home = now.length > 0 ? messages : root;
      if (notice.parentElement !== home) home.append(notice);
      choose();
    },
  };
}

/**
 * Whether messages stand at the foot rather than the head, given the boxes that they have there and whether they do now. They stay unless they cover a face and
 * would not on the other side; what is said `first` wants room to the faces as well, which move.
 */
export function belongsAtBottom(
  atBottom: boolean,
  [head, foot]: readonly [head: ScreenBox, foot: ScreenBox],
  faces: readonly ScreenBox[],
  isNew = false,
): boolean {
  const [here, there] = atBottom ? [foot, head] : [head, foot];
  const covers = (box: ScreenBox, room: number) => faces.some((face) => overlaps(box, face, room));
  const better =
    (covers(here, 0) && !covers(there, 0)) || (isNew && covers(here, FACE_MARGIN_PX) && !covers(there, FACE_MARGIN_PX));
  return better ? !atBottom : atBottom;
}
