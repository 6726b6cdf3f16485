/** Small pictures of motions, fetched when they scroll into view and kept while the page is open. */
import { fetchThumbnail } from "../../client/motion-library";
import { element } from "../dom";

/** Number of pictures that are fetched at the same time. The server draws them together. */
const MAX_CONCURRENT_REQUESTS = 6;
/** Number of pictures that are kept; each has about 3 kB. */
const MAX_KEPT_PICTURES = 400;

/** Distance from the visible part of the list at which pictures are fetched. */
const MARGIN = "120px";

export class MotionPictures {
  readonly #kept = new Map<string, HTMLImageElement>();
  readonly #motions = new WeakMap<Element, string>();
  readonly #waiting: Element[] = [];
  #requests = 0;
  readonly #observer = new IntersectionObserver(
    (entries) => {
      for (const { target, isIntersecting } of entries) {
        if (!isIntersecting) continue;
        this.#observer.unobserve(target);
        this.#waiting.push(target);
      }
      this.#fetchNext();
    },
    { rootMargin: MARGIN },
  );

  /** Show the picture of a motion in `frame` once it is in view. What `frame` contains stays if there is no picture. */
  show(frame: Element, motion: string): void {
    const image = this.#kept.get(motion);
    if (image) {
      // The most recently used one is last.
      this.#kept.delete(motion);
      this.#kept.set(motion, image);
      frame.replaceChildren(image);
      return;
    }
    this.#motions.set(frame, motion);
    this.#observer.observe(frame);
  }

  #fetchNext(): void {
    while (this.#requests < MAX_CONCURRENT_REQUESTS) {
      const frame = this.#waiting.shift();
      if (!frame) return;
      const motion = this.#motions.get(frame);
      // The list may have been rendered again meanwhile.
      if (motion === undefined || !frame.isConnected) continue;
      this.#requests++;
      void this.#fetch(frame, motion).finally(() => {
        this.#requests--;
        this.#fetchNext();
      });
    }
  }

  async #fetch(frame: Element, motion: string): Promise<void> {
    if (!this.#kept.has(motion)) {
      // Without a picture, the drawn figure stays. An older server has none.
      const picture = await fetchThumbnail(motion).catch(() => null);
      if (!picture) return;
      const image = element("img", { src: URL.createObjectURL(picture), draggable: "false" });
      // Decoration: the name is beside it.
      image.alt = "";
      this.#keep(motion, image);
    }
    this.show(frame, motion);
  }

  #keep(motion: string, image: HTMLImageElement): void {
    this.#kept.set(motion, image);
    for (const [oldest, { src }] of this.#kept) {
      if (this.#kept.size <= MAX_KEPT_PICTURES) break;
      URL.revokeObjectURL(src);
      this.#kept.delete(oldest);
    }
  }
}
