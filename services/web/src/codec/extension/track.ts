/**
 * Extension tracks: further joints, fingers and a face of a performer beside its motion, and the decoder of their
 * blocks (`proto/codec.md`, 2.17 to 2.19).
 */

import type { BodyExtension } from "../../motion/extension";
import type { Face } from "../../motion/face";
import type { Hands } from "../../motion/hands";
import type { ChannelLayout } from "../channel-layout";
import { decodeCoefficients } from "../coefficients";
import { DamagedBlock } from "../errors";
import { reconstruct, stepSize } from "../motion-decoder";
import { loadShippedPrior, type Prior } from "../prior";
import { MAX_BLOCK_FRAMES, parseTiming, Timing, type TrackDescription } from "../timing";
import { cosineBasis } from "../transform";
import { bodyLayout, inverseBodyWeights, unpackBody } from "./body-joints";
import { faceLayout, inverseFaceWeights, unpackFace } from "./face-axes";
import { fingerLayout, inverseFingerWeights, unpackFingers } from "./finger-joints";

/** Part of a performer that an extension adds. */
export type ExtensionPart = "body" | "fingers" | "face";
export const EXTENSION_PARTS: readonly ExtensionPart[] = ["body", "fingers", "face"];

/** What an extension adds to a performer. */
export type ExtensionContent =
  | { readonly part: "body"; readonly body: BodyExtension }
  | { readonly part: "fingers"; readonly hands: Hands }
  | { readonly part: "face"; readonly face: Face };

/** Content of an extension with the coding of its blocks. */
interface Coding {
  readonly content: ExtensionContent;
  readonly layout: ChannelLayout;
  /** Inverses [E][3][3] of the weights with which values were multiplied before they were quantised. */
  readonly inverseWeights: Float64Array;
}

/** Codec of each part, the key of its description, and the function that reads it. */
const FORMATS: Readonly<Record<ExtensionPart, { codec: string; key: string; unpack: (data: Uint8Array) => Coding }>> = {
  body: {
    codec: "bunraku.extension/1",
    key: "joints",
    unpack: (data) => {
      const body = unpackBody(data);
      return { content: { part: "body", body }, layout: bodyLayout(body), inverseWeights: inverseBodyWeights(body) };
    },
  },
  fingers: {
    codec: "bunraku.extension/2",
    key: "joints",
    unpack: (data) => {
      const [hands, offsets] = unpackFingers(data);
      const layout = fingerLayout(hands, offsets);
      return { content: { part: "fingers", hands }, layout, inverseWeights: inverseFingerWeights(hands) };
    },
  },
  face: {
    codec: "bunraku.extension/2",
    key: "axes",
    unpack: (data) => {
      const [face, offsets] = unpackFace(data);
      const layout = faceLayout(face, offsets);
      return { content: { part: "face", face }, layout, inverseWeights: inverseFaceWeights(layout.count) };
    },
  },
};

const cosines = new Float64Array(MAX_BLOCK_FRAMES);

/** Timing and content of an extension of one performer, which has this index among the motion's. */
export class ExtensionTrack extends Timing {
  readonly content: ExtensionContent;
  readonly layout: ChannelLayout;
  readonly inverseWeights: Float64Array;

  constructor(
    timing: Timing,
    readonly performer: number,
    { content, layout, inverseWeights }: Coding,
  ) {
    super(timing.fps, timing.frames, timing.blockFrames, timing.firstFrames);
    this.content = content;
    this.layout = layout;
    this.inverseWeights = inverseWeights;
  }

  /**
   * Returns the track of a Description's map of type `extension`.
   *
   * @throws DamagedBlock if it is invalid or of another codec or part
   */
  static fromDescription(description: TrackDescription): ExtensionTrack {
    const { codec, part, performer } = description;
    const format = EXTENSION_PARTS.includes(part as ExtensionPart) ? FORMATS[part as ExtensionPart] : null;
    if (!format || codec !== format.codec)
      throw new DamagedBlock(`Unsupported extension of codec ${String(codec)} and part ${String(part)}.`);
    const timing = parseTiming(description, "extension");
    const packed = description[format.key];
    if (!Number.isInteger(performer) || Number(performer) < 0 || !(packed instanceof Uint8Array))
      throw new DamagedBlock(`Invalid extension track: performer must be an index, and ${format.key} must be bytes.`);
    return new ExtensionTrack(timing, Number(performer), format.unpack(packed));
  }
}

/** A decoded block. */
export class ExtensionBlock {
  /**
   * @param frames frames of the block
   * @param count frequencies of each value
   * @param values coefficients [E][axis 3][count], radians
   */
  constructor(
    readonly frames: number,
    private readonly count: number,
    private readonly values: Float64Array,
  ) {}

  /**
   * Writes the values [E][3] at `t`, in frames from the block's first, any real in [-1/2, frames - 1/2], into `out`.
   */
  valuesAt(t: number, out: Float64Array): void {
    const { count, values } = this;
    cosineBasis(cosines, this.frames, count, t);
    for (let number = 0, at = 0; number < out.length; number++) {
      let sum = 0;
      for (let k = 0; k < count; k++) sum += values[at++] * cosines[k];
      out[number] = sum;
    }
  }
}

/**
 * Decodes one block of `track`. `prior` must be the one with which the block was encoded.
 *
 * @throws DamagedBlock
 */
export function decodeExtensionBlock(
  track: ExtensionTrack,
  data: Uint8Array,
  prior: Prior = loadShippedPrior(),
): ExtensionBlock {
  const { layout, inverseWeights } = track;
  const { frames, step, count, q } = decodeCoefficients(prior, data, track.blockFrames, track.fps, layout);
  const size = stepSize(step, frames);
  const values = new Float64Array(layout.count * 3 * count);
  for (let joint = 0; joint < layout.count; joint++) {
    for (let k = 0; k < count; k++) {
      for (let axis = 0; axis < 3; axis++) {
        let sum = 0;
        for (let other = 0; other < 3; other++)
          sum += inverseWeights[joint * 9 + axis * 3 + other] * reconstruct(q[(joint * 3 + other) * count + k]) * size;
        values[(joint * 3 + axis) * count + k] = sum;
      }
    }
  }
  return new ExtensionBlock(frames, count, values);
}
