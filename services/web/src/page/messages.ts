/** Where what is said stands: at the head of the page, and at its foot where a face is there. */
import { overlaps, type Box } from "../stage/boxes";
import { element, setAttribute } from "./dom";

export interface Messages {
  readonly element: HTMLElement;
  /** Keeps clear of the faces of those who dance, CSS pixels: told of every frame. */
  keepOff(faces: readonly Box[]): void;
}

/** Pixels to a face, that will move. */
const ROOM = 20;

/** `moved` is told when they have another place. While somebody dances the `notice` stands among them, else in the middle of the stage. */
export function createMessages(root: HTMLElement, notice: HTMLElement, moved: () => void): Messages {
  const messages = element("div", { class: "messages" });
  root.append(messages);
  /** The boxes at the head and at the foot; null while nothing is said. */
  let places: readonly [head: Box, foot: Box] | null = null;
  let faces: readonly Box[] = [];
  let low = false;
  const put = (to: boolean) => {
    low = to;
    setAttribute(messages, "data-low", low);
    moved();
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
    if (places && standsLow(low, places, faces, first) !== low) put(!low);
  };
  new ResizeObserver(measure).observe(messages);
  addEventListener("resize", measure);
  return {
    element: messages,
    keepOff(now) {
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
export function standsLow(low: boolean, [head, foot]: readonly [head: Box, foot: Box], faces: readonly Box[], first = false): boolean {
  const [here, there] = low ? [foot, head] : [head, foot];
  const covers = (box: Box, room: number) => faces.some((face) => overlaps(box, face, room));
  const better = (covers(here, 0) && !covers(there, 0)) || (first && covers(here, ROOM) && !covers(there, ROOM));
  return better ? !low : low;
}
