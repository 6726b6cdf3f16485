/** Layouts of blocks: which channels a block has, and how the context model relates them (`proto/codec.md`, 2.10). */

import { CHANNEL_COUNT, JOINTS, PARENTS } from "../motion/skeleton";

/** Relative of a channel that has none. */
const NONE = -1;

/** Channels of a block, in the order in which they are coded. */
export interface ChannelLayout {
  readonly count: number;
  /** Channel of the prior whose biases apply to each channel. */
  readonly priorChannels: Uint8Array;
  /** Parent, mirror and grandparent of each channel among the earlier ones; `count` for none. */
  readonly parents: Uint8Array;
  readonly mirrors: Uint8Array;
  readonly grandparents: Uint8Array;
  /** Axes of each channel that are coded. */
  readonly axes: Uint8Array;
  /** Added to the predicted scale of each axis [count][3], log2 in 1/256. */
  readonly scaleOffsets: Int32Array;
  /** True if the header has a heading, and a bit that says whether only the root's two channels are coded. */
  readonly heading: boolean;
}

/** Optional properties of a layout: by default all axes are coded, without offsets and heading. */
interface LayoutOptions {
  readonly axes?: readonly number[];
  readonly scaleOffsets?: Int32Array;
  readonly heading?: boolean;
}

/** Return the layout of channels with these parents and mirrors, -1 for none. */
export function createLayout(
  priorChannels: readonly number[],
  parents: readonly number[],
  mirrors: readonly number[],
  { axes, scaleOffsets, heading = false }: LayoutOptions = {},
): ChannelLayout {
  const count = parents.length;
  const toIndices = (relatives: readonly number[]) =>
    Uint8Array.from(relatives, (relative) => (relative === NONE ? count : relative));
  return {
    count,
    priorChannels: Uint8Array.from(priorChannels),
    parents: toIndices(parents),
    mirrors: toIndices(mirrors),
    grandparents: toIndices(parents.map((parent) => (parent === NONE ? NONE : parents[parent]))),
    axes: Uint8Array.from(axes ?? parents.map(() => 3)),
    scaleOffsets: scaleOffsets ?? new Int32Array(count * 3),
    heading,
  };
}

// a joint of the right side mirrors one of the left, any other the joint before it
const JOINT_MIRRORS = JOINTS.map((name, joint) =>
  name.startsWith("r_") ? JOINTS.indexOf(`l${name.slice(1)}`) + 1 : joint,
);

/** The 19 channels of a performer. */
export const MOTION_LAYOUT = createLayout(
  Array.from({ length: CHANNEL_COUNT }, (_, channel) => channel),
  [NONE, 0, ...PARENTS.slice(1).map((joint) => joint + 1)],
  [NONE, NONE, ...JOINT_MIRRORS.slice(1)],
  { heading: true },
);

/** The seven values of a camera or light, in three channels. */
export const SCENE_LAYOUT = createLayout([0, 1, 2], [NONE, 0, 1], [NONE, NONE, 1], { axes: [3, 3, 1] });
