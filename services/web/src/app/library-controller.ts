/** Motion list of the library, and its display in the library panel and the header. */
import type { MotionQuery } from "../client/api";
import type { MotionLabels } from "../client/motion-library";
import type { MotionItem } from "../ui/library/motion-item";
import { MotionList } from "../ui/library/motion-list";
import type { Page } from "../ui/page";
import type { RemotePlayback } from "./remote-playback";

/** Interval at which the library is looked at for a motion that is being stored, and the number of times. */
const [STORED_INTERVAL_MS, STORED_ATTEMPTS] = [1000, 30];

/** Interval at which the library is looked at for takes that the server stores later, and the number of times. */
const [PENDING_INTERVAL_MS, PENDING_ATTEMPTS] = [5000, 60];

export class LibraryController {
  readonly motions = new MotionList();

  constructor(
    private readonly page: Pick<Page, "library" | "header">,
    private readonly getPlayback: () => RemotePlayback | null,
  ) {}

  /** The motion on the stage; null if there is none, or if the list does not contain it. */
  get currentItem(): MotionItem | null {
    return this.motions.find(this.#currentMotion);
  }

  get #currentMotion(): string | null {
    const { motion = null, base = null } = this.getPlayback() ?? {};
    return this.motions.find(motion) ? motion : base;
  }

  /** Fetch the list and display it. Rejects with ProblemError. */
  async refresh(): Promise<void> {
    await this.motions.refresh();
    this.render();
  }

  /** Wait for a motion that the server is storing; null if it does not come. */
  async waitFor(id: string): Promise<MotionItem | null> {
    for (let attempt = 0; attempt < STORED_ATTEMPTS; attempt++) {
      await this.refresh().catch(() => undefined);
      const motion = this.motions.find(id);
      if (motion) return motion;
      await new Promise((resolve) => setTimeout(resolve, STORED_INTERVAL_MS));
    }
    return null;
  }

  /** Show motions that the server stores within the next minutes. */
  async refreshRepeatedly(): Promise<void> {
    for (let attempt = 0; attempt < PENDING_ATTEMPTS; attempt++) {
      await new Promise((resolve) => setTimeout(resolve, PENDING_INTERVAL_MS));
      await this.refresh().catch(() => undefined);
    }
  }

  /** Delete a motion from the library. Rejects with ProblemError. */
  async remove(id: string): Promise<void> {
    await this.motions.remove(id);
    this.render();
  }

  /** Show the motions of a query. Rejects with ProblemError. */
  async search(query: MotionQuery): Promise<void> {
    await this.motions.search(query);
    this.render();
  }

  /** Change the name or tags of a motion. Rejects with ProblemError. */
  async label(id: string, labels: MotionLabels): Promise<void> {
    await this.motions.label(id, labels);
    this.render();
  }

  render(): void {
    const { items, found, tags } = this.motions;
    this.page.library.renderMotions(found ?? items, this.#currentMotion, { tags, isFiltered: found !== null });
    this.page.header.setMotionName(this.currentItem?.name ?? "");
  }
}
