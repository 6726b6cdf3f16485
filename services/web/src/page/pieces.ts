/** The library's motions as the page names them. */
import { deleteMotion, listMotions, type Motion } from "../client/library";
import { figure, pieceName } from "./format";
import type { Piece } from "./library";
import { series, say } from "../words/say";

/** Pages of the list that are read; beyond them the newest are enough to choose from. */
const MOST_PAGES = 5;

export function asPiece(motion: Motion): Piece {
  return { id: motion.id, name: motion.name || pieceName(motion.filename), detail: kind(motion), seconds: motion.duration, performers: motion.performers ?? 1 };
}

/** "BVH, 120 Hz, 2 dancers, with music". */
function kind({ filename, fps, tracks, performers = 1 }: Motion): string {
  const ending = /\.([^.]+)$/.exec(filename)?.[1];
  const music = tracks?.includes("audio") ? say("with music") : null;
  const dancers = performers > 1 ? say("{count} dancers", { count: performers }) : null;
  return series([ending?.toUpperCase(), `${Number.isInteger(fps) ? fps : figure(fps)} Hz`, dancers, music].filter((word) => word != null));
}

export class Pieces {
  all: Piece[] = [];

  /** Reads the list again. Throws ProblemError. */
  async refresh(): Promise<void> {
    const found: Piece[] = [];
    let cursor: string | undefined;
    for (let page = 0; page < MOST_PAGES; page++) {
      const { items, next } = await listMotions(cursor);
      found.push(...items.map(asPiece));
      if (next === null) break;
      cursor = next;
    }
    this.all = found;
  }

  async remove(id: string): Promise<void> {
    await deleteMotion(id);
    this.all = this.all.filter((piece) => piece.id !== id);
  }

  find(id: string | null): Piece | null {
    return this.all.find((piece) => piece.id === id) ?? null;
  }
}
