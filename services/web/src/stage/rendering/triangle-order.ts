/**
 * Order of triangles for software rendering. SwiftShader computes four corners at a time: from the first one that its
 * cache of 64 lacks, the next four of the list, whether it has the others or not. In the order of a grid two of them are
 * there already.
 */

/** Triangles that are reordered among themselves: their corners are fewer than the cache has places. */
const BLOCK_TRIANGLES = 16;

/**
 * Return the triangles of a mesh (indices of their corners) with those first, in each block, that have no corner in
 * common: all four corners computed at a time are new. The other triangles of the block then find theirs in the cache.
 */
export function orderTriangles(indices: ArrayLike<number>): number[] {
  const ordered: number[] = [];
  const blockLength = 3 * BLOCK_TRIANGLES;
  for (let start = 0; start < indices.length; start += blockLength) {
    const seen = new Set<number>();
    const later: number[] = [];
    for (let at = start; at < Math.min(start + blockLength, indices.length); at += 3) {
      const triangle = [indices[at], indices[at + 1], indices[at + 2]];
      if (triangle.some((corner) => seen.has(corner))) {
        later.push(...triangle);
        continue;
      }
      ordered.push(...triangle);
      for (const corner of triangle) seen.add(corner);
    }
    ordered.push(...later);
  }
  return ordered;
}
