/** Keeps things on a line from covering each other. Pure. */

/**
 * The places nearest to `places` (in the sum of squares) that are `least` apart at least, in their order on the line: sorted neighbours that are too near go apart
 * together about their middle (isotonic regression by pooling, Ayer et al. 1955).
 */
export function apart(places: readonly number[], least: number): number[] {
  const order = places.map((_, nth) => nth).sort((a, b) => places[a] - places[b]);
  // with their least distances taken away they only have to be in order
  const pools: { sum: number; count: number }[] = [];
  order.forEach((nth, rank) => {
    let pool = { sum: places[nth] - rank * least, count: 1 };
    for (let before = pools.at(-1); before && before.sum / before.count > pool.sum / pool.count; before = pools.at(-1)) {
      pool = { sum: pool.sum + before.sum, count: pool.count + before.count };
      pools.pop();
    }
    pools.push(pool);
  });
  const means = pools.flatMap(({ sum, count }) => Array<number>(count).fill(sum / count));
  const found = [...places];
  order.forEach((nth, rank) => (found[nth] = means[rank] + rank * least));
  return found;
}
