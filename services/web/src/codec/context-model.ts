/**
 * Context model: predicts the scale of the next coefficient from those already decoded (`proto/codec.md`, 2.10,
 * Features, Prior). All arithmetic is in integers that fit in 32 bits, with the same results as
 * `codec/_kernels/context_model.py`.
 */

import type { ChannelLayout } from "./channel-layout";
import { magnitudeLevels } from "./magnitude-level";
import { CHANNEL_AXES, FEATURE_COUNT, HIDDEN_UNITS, type Prior, SHARED_FEATURES, SUM_COUNT } from "./prior";

/** Limits of a predicted scale, log2 in 1/256. */
export const MIN_SCALE = -7 * 256;
export const MAX_SCALE = 14 * 256;

/** Class of each frequency: 0, 1, 2, 3-4, 5-8, 9-15, 16 and above. */
export const FREQUENCY_CLASS_OF = Uint8Array.from(
  { length: 513 },
  (_, k) => [1, 2, 3, 5, 9, 16].filter((first) => k >= first).length,
);

const ZERO_SUMS = new Float64Array(SUM_COUNT);

// zeros before and after the frequencies
const PADDING_BEFORE = 3;
const PADDING_TOTAL = 8;

/**
 * Magnitude levels of the coefficients of one block that are already decoded. For each frequency of a channel, call
 * `computeSharedSums`, then `predictScale` and `updateMagnitude` for each axis, then `finishFrequency`; after the last
 * frequency, `finishChannel`.
 */
export class ContextModel {
  private readonly width: number;
  /** Level of each coefficient: [channel, and one for none][axis 3][`width`]. */
  private readonly axisLevels: Int32Array;
  /** Means over the three axes: [channel, and one for none][`width`]. */
  private readonly meanLevels: Int32Array;
  /** Sums of the means over the finished channels. */
  private readonly levelTotals: Int32Array;
  /** Sum of this channel's means below the frequency. */
  private runningSum = 0;
  private readonly features = new Float64Array(FEATURE_COUNT);
  private readonly sharedSums = new Float64Array(SUM_COUNT);
  private readonly sums = new Float64Array(SUM_COUNT);
  private readonly magnitudeLevels = magnitudeLevels();

  /**
   * @param layout channels of the block
   * @param count frequencies of the block
   * @param step step index of the block
   * @param durationLevel level of its duration
   */
  constructor(
    private readonly prior: Prior,
    private readonly layout: ChannelLayout,
    private readonly count: number,
    private readonly step: number,
    private readonly durationLevel: number,
  ) {
    this.width = count + PADDING_TOTAL;
    // a missing relative reads as zeros
    this.axisLevels = new Int32Array((layout.count + 1) * 3 * this.width);
    this.meanLevels = new Int32Array((layout.count + 1) * this.width);
    this.levelTotals = new Int32Array(this.width);
  }

  /** Computes the features and sums that the three axes of frequency `k` share. */
  computeSharedSums(channel: number, k: number): void {
    const { features: f, meanLevels: means, levelTotals: totals, width, sharedSums: shared, layout } = this;
    const at = k + PADDING_BEFORE;
    const own = channel * width + at;
    const parent = layout.parents[channel] * width + at;
    const mirror = layout.mirrors[channel] * width + at;
    const grandparent = layout.grandparents[channel] * width + at;
    const done = channel > 1 ? channel : 1;
    if (k === 0) this.runningSum = 0;
    f[0] = means[own - 1];
    f[1] = means[own - 2];
    f[2] = means[own - 3];
    f[3] = means[parent];
    f[4] = means[parent - 1];
    f[5] = means[parent + 1];
    f[6] = ((means[parent + 2] + means[parent + 3] + means[parent + 4]) / 3) | 0;
    f[7] = means[mirror];
    f[8] = means[mirror - 1];
    f[9] = means[mirror + 1];
    f[10] = ((means[mirror + 2] + means[mirror + 3] + means[mirror + 4]) / 3) | 0;
    f[11] = means[grandparent];
    f[12] = (means[grandparent + 1] + means[grandparent + 2]) >> 1;
    f[13] = (totals[at] / done) | 0;
    f[14] = (totals[at - 1] / done) | 0;
    f[15] = (totals[at + 1] / done) | 0;
    f[16] = ((totals[at + 2] + totals[at + 3] + totals[at + 4]) / (3 * done)) | 0;
    f[17] = (this.runningSum / (k + 1)) | 0;
    f[18] = channel > 0 ? means[own - width] : 0;
    f[19] = channel > 1 ? means[own - 2 * width] : 0;
    f[20] = this.count - k < 63 ? this.count - k : 63;
    f[21] = this.magnitudeLevels[k];
    f[22] = this.step;
    f[23] = this.durationLevel;
    accumulateSums(
      shared,
      ZERO_SUMS,
      ZERO_SUMS,
      0,
      f,
      0,
      SHARED_FEATURES,
      this.prior.weights,
      FREQUENCY_CLASS_OF[k] * FEATURE_COUNT * SUM_COUNT,
    );
  }

  /** Returns the predicted scale of one coefficient, log2 in 1/256, after `computeSharedSums` of its frequency. */
  predictScale(channel: number, axis: number, k: number): number {
    const { features: f, axisLevels: axes, width, sharedSums: shared, sums, layout } = this;
    const { weights, biases, out } = this.prior;
    const at = k + PADDING_BEFORE;
    const first = channel * 3 * width + at;
    const own = first + axis * width;
    const parent = (layout.parents[channel] * 3 + axis) * width + at;
    const mirror = (layout.mirrors[channel] * 3 + axis) * width + at;
    f[24] = axes[own - 1];
    f[25] = axes[own - 2];
    f[26] = axes[own - 3];
    // axes that are not decoded yet are zero
    f[27] = axes[first];
    f[28] = axes[first + width];
    f[29] = axes[parent];
    f[30] = axes[mirror];
    f[31] = axes[mirror + 1];
    const z = FREQUENCY_CLASS_OF[k];
    const bias = (z * CHANNEL_AXES + layout.priorChannels[channel] * 3 + axis) * SUM_COUNT;
    accumulateSums(
      sums,
      shared,
      biases,
      bias,
      f,
      SHARED_FEATURES,
      FEATURE_COUNT,
      weights,
      z * FEATURE_COUNT * SUM_COUNT,
    );
    let scale = (sums[0] >> 8) + layout.scaleOffsets[channel * 3 + axis];
    for (let unit = 0; unit < HIDDEN_UNITS; unit++) {
      const x = sums[1 + unit] >> 8;
      if (x > 0) scale += Math.imul(x < 32767 ? x : 32767, out[z * HIDDEN_UNITS + unit]) >> 12;
    }
    return scale < MIN_SCALE ? MIN_SCALE : scale > MAX_SCALE ? MAX_SCALE : scale;
  }

  /** Stores the level of a coefficient. */
  updateMagnitude(channel: number, axis: number, k: number, magnitude: number): void {
    this.axisLevels[(channel * 3 + axis) * this.width + k + PADDING_BEFORE] =
      this.magnitudeLevels[magnitude < 4095 ? magnitude : 4095];
  }

  /** Updates the mean of a frequency after its three axes. */
  finishFrequency(channel: number, k: number): void {
    const { axisLevels: axes, width } = this;
    const at = channel * 3 * width + k + PADDING_BEFORE;
    const mean = ((axes[at] + axes[at + width] + axes[at + 2 * width]) / 3) | 0;
    this.meanLevels[channel * width + k + PADDING_BEFORE] = mean;
    this.runningSum += mean;
  }

  /** Adds the means of a finished channel to the totals. */
  finishChannel(channel: number): void {
    const { meanLevels: means, levelTotals: totals, width } = this;
    for (let at = 0; at < width; at++) totals[at] += means[channel * width + at];
  }
}

/**
 * Computes the nine sums: `start`, plus the biases from index `bias`, plus the features `from` .. `to` - 1 times the
 * weights [feature][sum] from index `base`. A decoder spends most of its time here, so each sum is a variable that
 * stays in a register. The sums are integers in doubles, which are at least as fast and have more registers.
 */
function accumulateSums(
  out: Float64Array,
  start: Float64Array,
  biases: Float64Array,
  bias: number,
  features: Float64Array,
  from: number,
  to: number,
  weights: Float64Array,
  base: number,
): void {
  let a = start[0] + biases[bias];
  let b = start[1] + biases[bias + 1];
  let c = start[2] + biases[bias + 2];
  let d = start[3] + biases[bias + 3];
  let e = start[4] + biases[bias + 4];
  let f = start[5] + biases[bias + 5];
  let g = start[6] + biases[bias + 6];
  let h = start[7] + biases[bias + 7];
  let i = start[8] + biases[bias + 8];
  for (let feature = from; feature < to; feature++) {
    const value = features[feature],
      at = base + feature * SUM_COUNT;
    a += value * weights[at];
    b += value * weights[at + 1];
    c += value * weights[at + 2];
    d += value * weights[at + 3];
    e += value * weights[at + 4];
    f += value * weights[at + 5];
    g += value * weights[at + 6];
    h += value * weights[at + 7];
    i += value * weights[at + 8];
  }
  out[0] = a;
  out[1] = b;
  out[2] = c;
  out[3] = d;
  out[4] = e;
  out[5] = f;
  out[6] = g;
  out[7] = h;
  out[8] = i;
}

/**
 * Returns the context of the sign of the coefficient at `offset`, frequency `k`, from those two and four frequencies
 * below. If a block cuts a movement off, every second frequency has the same sign.
 */
export function signContext(q: Float64Array, offset: number, k: number): number {
  const near = k > 2 ? q[offset - 2] : 0;
  const far = k > 4 ? q[offset - 4] : 0;
  return 3 * ((near < -2 ? -2 : near > 2 ? 2 : near) + 2) + (far < 0 ? 0 : far > 0 ? 2 : 1);
}
