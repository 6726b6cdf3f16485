/** The library's motions as the page names them. */
import { deleteMotion, listMotions, type Motion } from "../../client/api";
import { joinList, translate } from "../../i18n/translator";
import { formatFigure, motionNameFromFile } from "../format";
import type { MotionItem } from "./library-panel";

/** Pages of the list that are read; beyond them the newest are enough to choose from. */
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

/** "BVH, 120 Hz, 2 dancers, with music". */
function describeMotion({ filename, fps, tracks, performers = 1 }: Motion): string {
  const ending = /\.([^.]+)$/.exec(filename)?.[1];
  const music = tracks?.includes("audio") ? translate("with music") : null;
  const dancers = performers > 1 ? translate("{count} dancers", { count: performers }) : null;
  return joinList(
    [ending?.toUpperCase(), `${Number.isInteger(fps) ? fps : formatFigure(fps)} Hz`, dancers, music].filter(
      (word) => word != null,
    ),
  );
}

export class MotionList {
  items: MotionItem[] = [];

  /** Reads the list again. Throws ProblemError. */
  async refresh(): Promise<void> {
    const found: MotionItem[] = [];
    let cursor: string | undefined;
    for (let page = 0; page < MAX_PAGES; page++) {
      const { items, next } = await listMotions(cursor);
      found.push(...items.map(toMotionItem));
      if (next === null) break;
      cursor = next;
    }
    this.items = found;
  }

  async remove(id: string): Promise<void> {
    await deleteMotion(id);
    this.items = this.items.filter((piece) => piece.id !== id);
  }

  find(id: string | null): MotionItem | null {
    return this.items.find((piece) => piece.id === id) ?? null;
  }
}
