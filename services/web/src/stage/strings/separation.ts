/** Keeps things on a line from covering each other. Pure. */

/**
 * The places nearest to `places` (in the sum of squares) that are `least` apart at least, in their order on the line: sorted neighbours that are too near go apart
 * together about their middle (isotonic regression by pooling, Ayer et al. 1955).
 */
export function separate(positions: readonly number[], minDistance: number): number[] {
  const order = positions.map((_, nth) => nth).sort((a, b) => positions[a] - positions[b]);
  // with their least distances taken away they only have to be in order
  const pools: { sum: number; count: number }[] = [];
  order.forEach((nth, rank) => {
    let pool = { sum: positions[nth] - rank * minDistance, count: 1 };
    for (
      let before = pools.at(-1);
      before && before.sum / before.count > pool.sum / pool.count;
      before = pools.at(-1)
    ) {
      pool = { sum: pool.sum + before.sum, count: pool.count + before.count };
      pools.pop();
    }
    pools.push(pool);
  });
  const means = pools.flatMap(({ sum, count }) => Array<number>(count).fill(sum / count));
  const found = [...positions];
  order.forEach((nth, rank) => (found[nth] = means[rank] + rank * minDistance));
  return found;
}
