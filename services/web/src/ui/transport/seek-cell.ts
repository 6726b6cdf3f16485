/** Cells of the seek bar: blocks of a motion, merged if there are too many to show. Pure. */

/** Cell with `quality` 0 (lowest) to 3 (best), or -1 if one of its blocks is missing. Start and end as fractions. */
export interface SeekCell {
  quality: number;
  start: number;
  end: number;
}

/**
 * Return at most `maxCells` cells for blocks of the given bitrate levels (-1 for a missing block). A merged cell has
 * the quality of its worst block, so that no gap is hidden.
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

/** Map a bitrate level to one of the four qualities shown; -1 stays -1. */
export function qualityOf(level: number, levelCount: number): number {
  if (level < 0) return -1;
  return levelCount <= 1 ? 3 : Math.round((level / (levelCount - 1)) * 3);
}

/** Return the time in seconds up to which all blocks from `position` on are loaded. */
export function bufferedTo(blocks: ArrayLike<number>, position: number, duration: number): number {
  if (blocks.length === 0 || !(duration > 0)) return 0;
  const length = duration / blocks.length;
  let block = Math.min(blocks.length - 1, Math.max(0, Math.floor(position / length)));
  while (block < blocks.length && blocks[block] >= 0) block++;
  return Math.max(0, block * length < position ? position : block * length);
}
