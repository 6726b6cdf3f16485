/** Motions of the library. */
import { deleteMotion, listMotions, type Motion } from "../../client/api";
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

  /** Fetch the list. Rejects with ProblemError. */
  async refresh(): Promise<void> {
    const motions: MotionItem[] = [];
    let cursor: string | undefined;
    for (let page = 0; page < MAX_PAGES; page++) {
      const { items, next } = await listMotions(cursor);
      motions.push(...items.map(toMotionItem));
      if (next === null) break;
      cursor = next;
    }
    this.items = motions;
  }

  async remove(id: string): Promise<void> {
    await deleteMotion(id);
    this.items = this.items.filter((motion) => motion.id !== id);
  }

  find(id: string | null): MotionItem | null {
    return this.items.find((motion) => motion.id === id) ?? null;
  }
}
