/** Motions of the library. */
import { deleteMotion, listMotions, type Motion, type MotionQuery } from "../../client/api";
import { type MotionLabels, updateMotion } from "../../client/motion-library";
import { joinList, translate } from "../../i18n/translator";
import { formatFigure, motionNameFromFile } from "../format";
import type { MotionItem } from "./motion-item";

/** Maximum number of pages that are fetched. The newest motions come first. */
const MAX_PAGES = 5;

export function toMotionItem(motion: Motion): MotionItem {
  return {
    id: motion.id,
    name: motion.name || motionNameFromFile(motion.filename),
    detail: describeMotion(motion),
    seconds: motion.duration,
    performers: motion.performers ?? 1,
    tags: motion.tags ?? [],
  };
}

/** Describe a motion in a few words: "BVH, 120 Hz, 2 dancers, with music". */
function describeMotion({ filename, fps, tracks, performers = 1 }: Motion): string {
  const extension = /\.([^.]+)$/.exec(filename)?.[1];
  const music = tracks?.includes("audio") ? translate("with music") : null;
  const dancers = performers > 1 ? translate("{count} dancers", { count: performers }) : null;
  return joinList(
    [extension?.toUpperCase(), `${Number.isInteger(fps) ? fps : formatFigure(fps)} Hz`, dancers, music].filter(
      (part) => part != null,
    ),
  );
}

export class MotionList {
  items: MotionItem[] = [];
  /** Motions of the last search, null without one. */
  found: MotionItem[] | null = null;
  #query: MotionQuery = { search: "", tag: "" };

  /** All tags of the motions, in the order of the list. */
  get tags(): string[] {
    return [...new Set(this.items.flatMap((motion) => motion.tags))];
  }

  /** Fetch the list, and what the last search finds in it. Rejects with ProblemError. */
  async refresh(): Promise<void> {
    this.items = await fetchMotions();
    await this.search(this.#query);
  }

  /** Find the motions of a query, all for an empty one; the latest search counts. Rejects with ProblemError. */
  async search(query: MotionQuery): Promise<void> {
    this.#query = query;
    const found = query.search || query.tag ? await fetchMotions(query) : null;
    if (this.#query === query) this.found = found;
  }

  async remove(id: string): Promise<void> {
    await deleteMotion(id);
    const isOther = (motion: MotionItem) => motion.id !== id;
    this.items = this.items.filter(isOther);
    this.found = this.found?.filter(isOther) ?? null;
  }

  /** Change the name or tags of a motion. It stays in the list of found motions. Rejects with ProblemError. */
  async label(id: string, labels: MotionLabels): Promise<void> {
    const changed = toMotionItem(await updateMotion(id, labels));
    const replace = (motion: MotionItem) => (motion.id === id ? changed : motion);
    this.items = this.items.map(replace);
    this.found = this.found?.map(replace) ?? null;
  }

  find(id: string | null): MotionItem | null {
    return this.items.find((motion) => motion.id === id) ?? null;
  }
}

async function fetchMotions(query?: MotionQuery): Promise<MotionItem[]> {
  const motions: MotionItem[] = [];
  let cursor: string | undefined;
  for (let page = 0; page < MAX_PAGES; page++) {
    const { items, next } = await listMotions(cursor, query);
    motions.push(...items.map(toMotionItem));
    if (next === null) break;
    cursor = next;
  }
  return motions;
}
