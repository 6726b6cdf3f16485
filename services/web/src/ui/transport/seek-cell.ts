/** The seek bar's cells: blocks of a motion, merged where there are too many to show. Pure. */

/** One cell: `quality` 0 (lowest rate) to 3 (best), or -1 while any of its blocks is missing. Fractions of the duration. */
export interface SeekCell {
  quality: number;
  start: number;
  end: number;
}

/**
 * Cells for blocks that hold the given rate each (-1 missing), at most `most` of them. A merged cell shows its poorest
 * block, so that a gap is never hidden.
 */
export function seekCells(blocks: ArrayLike<number>, levelCount: number, maxCells: number): SeekCell[] {
  const count = Math.min(blocks.length, maxCells);
  const cells: SeekCell[] = [];
  for (let i = 0; i < count; i++) {
    const [from, to] = [Math.floor((i * blocks.length) / count), Math.floor(((i + 1) * blocks.length) / count)];
    let worst = Infinity;
    for (let block = from; block < to; block++) worst = Math.min(worst, blocks[block]);
    cells.push({ quality: qualityOf(worst, levelCount), start: from / blocks.length, end: to / blocks.length });
  }
  return cells;
}

/** A rate's place among the rates as one of the four qualities shown; -1 stays -1. */
export function qualityOf(level: number, levelCount: number): number {
  if (level < 0) return -1;
  return levelCount <= 1 ? 3 : Math.round((level / (levelCount - 1)) * 3);
}

/** Seconds up to which every block from the one at `position` on is here. */
export function bufferedTo(blocks: ArrayLike<number>, position: number, duration: number): number {
  if (blocks.length === 0 || !(duration > 0)) return 0;
  const length = duration / blocks.length;
  let block = Math.min(blocks.length - 1, Math.max(0, Math.floor(position / length)));
  while (block < blocks.length && blocks[block] >= 0) block++;
  return Math.max(0, block * length < position ? position : block * length);
}
