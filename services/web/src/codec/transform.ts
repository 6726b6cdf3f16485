/**
 * Cosine transform of channel values over time: the orthonormal DCT-II over the n frames of a block, x(t) =
 * sum_k s_k X_k cos(pi (t + 1/2) k / n), s_0 = sqrt(1/n), s_k = sqrt(2/n) (`proto/codec.md`, 2.7).
 */

/** Writes the first `count` cosines of a block of `frames` frames at `instant`, in frames, into `out`. */
export function cosineBasis(out: Float64Array, frames: number, count: number, instant: number): void {
  const angle = (Math.PI / frames) * (instant + 0.5);
  const scale = Math.sqrt(2 / frames);
  out[0] = Math.sqrt(1 / frames);
  for (let k = 1; k < count; k++) out[k] = scale * Math.cos(angle * k);
}
