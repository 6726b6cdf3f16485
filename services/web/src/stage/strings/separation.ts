/** Separation of objects along one dimension. Pure. */

/**
 * Return the positions nearest to `positions` (least squares) that are at least `minDistance` apart, in the same order:
 * neighbours that are too close move apart around their mean (isotonic regression by pooling, Ayer et al. 1955).
 */
export function separate(positions: readonly number[], minDistance: number): number[] {
  const order = positions.map((_, index) => index).sort((a, b) => positions[a] - positions[b]);
  // Without the minimum distances the positions only have to ascend.
  const pools: { sum: number; count: number }[] = [];
  order.forEach((index, rank) => {
    let pool = { sum: positions[index] - rank * minDistance, count: 1 };
    for (
      let previous = pools.at(-1);
      previous && previous.sum / previous.count > pool.sum / pool.count;
      previous = pools.at(-1)
    ) {
      pool = { sum: pool.sum + previous.sum, count: pool.count + previous.count };
      pools.pop();
    }
    pools.push(pool);
  });
  const means = pools.flatMap(({ sum, count }) => Array<number>(count).fill(sum / count));
  const separated = [...positions];
  order.forEach((index, rank) => (separated[index] = means[rank] + rank * minDistance));
  return separated;
}

/**
 * Return positions that are `minDistance` apart, moved between `left` and `right` with the same distances. If there is
 * too little space, they extend beyond `right`.
 */
export function limit(
  positions: readonly number[],
  minDistance: number,
  [left, right]: readonly [left: number, right: number],
): number[] {
  const order = positions.map((_, index) => index).sort((a, b) => positions[a] - positions[b]);
  const limited = [...positions];
  const last = order.length - 1;
  order.forEach((index, rank) => (limited[index] = Math.min(limited[index], right - (last - rank) * minDistance)));
  order.forEach((index, rank) => (limited[index] = Math.max(limited[index], left + rank * minDistance)));
  return limited;
}
