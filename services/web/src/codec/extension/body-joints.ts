/** Body extension in a track: description of its joints, layout of its blocks, and weights (`proto/codec.md`, 2.17). */

import {
  type BodyExtension,
  extensionKinds,
  extensionNames,
  type JointKind,
  SPINE_NAMES,
} from "../../motion/extension";
import { JOINTS } from "../../motion/skeleton";
import { length } from "../../motion/vector";
import { type ChannelLayout, createLayout } from "../channel-layout";
import { DamagedBlock } from "../errors";
import { decodeIntegers } from "../integer-coder";

/** Units of the integers that describe an extension. */
export const LENGTH_UNIT_M = 5e-4;
const DRIVE_UNIT = 2 ** -5;
const REST_UNIT_RAD = 2 ** -9;
const NECK_BIT = 8;
const CLAVICLES_BIT = 16;
/** Integers of a joint: offset, rest and drive. */
const ROW = 15;
const MAX_BODY_BYTES = 512;

/** Lever arm about a bone, for what turns with it, in metres. */
const TWIST_RADIUS_M = 0.04;
/** Channels of a motion whose biases the prior applies to an extension's joints. */
const PRIOR_CHANNELS: Readonly<Record<JointKind, number>> = {
  spine: JOINTS.indexOf("vl5") + 1,
  neck: JOINTS.indexOf("skullbase") + 1,
  "left clavicle": JOINTS.indexOf("l_shoulder") + 1,
  "right clavicle": JOINTS.indexOf("r_shoulder") + 1,
};

/**
 * Returns the extension that the bytes of `joints` describe.
 *
 * @throws DamagedBlock
 */
export function unpackBody(data: Uint8Array): BodyExtension {
  const flags = data[0] ?? 0;
  const spineCount = flags & 7;
  const kinds = extensionKinds(spineCount, (flags & NECK_BIT) !== 0, (flags & CLAVICLES_BIT) !== 0);
  const count = kinds.length;
  if (spineCount >= SPINE_NAMES.length || count === 0 || flags >> 5 || data.length > MAX_BODY_BYTES) {
    throw new DamagedBlock(
      `Invalid extension: its first byte is ${flags} and it has ${data.length} bytes, expected ` +
        `1..${SPINE_NAMES.length - 1} joints of the spine, a neck or clavicles, and at most ${MAX_BODY_BYTES} bytes.`,
    );
  }
  const integers = decodeIntegers(data.subarray(1), ...integerModels(kinds));
  const column = (from: number, size: number, unit: number) =>
    Float64Array.from(
      { length: count * size },
      (_, at) => integers[Math.floor(at / size) * ROW + from + (at % size)] * unit,
    );
  return {
    kinds,
    names: extensionNames(kinds),
    offsets: column(0, 3, LENGTH_UNIT_M),
    rest: column(3, 3, REST_UNIT_RAD),
    drive: column(6, 9, DRIVE_UNIT),
    ends: integers.subarray(count * ROW).map((value) => value * LENGTH_UNIT_M),
  };
}

/**
 * Returns the group of models of each integer that describes an extension, and the integer that it mirrors. Groups are
 * lengths by axis (0-2), rests (3), the diagonals of drives (4), their other elements (5), mirrored lengths (6), and
 * other mirrored integers (7).
 */
function integerModels(kinds: readonly JointKind[]): [groups: number[], mirrors: number[]] {
  const count = kinds.length;
  const joint = [0, 1, 2, 3, 3, 3, 4, 5, 5, 5, 4, 5, 5, 5, 4];
  const groups = [...kinds.flatMap(() => joint), 0, 1, 2, 0, 1, 2, 0, 1, 2];
  const mirrors = groups.map((group, index) => {
    const isClavicle = kinds.at(-1) === "right clavicle" && index >= (count - 1) * ROW && index < count * ROW;
    const distance = isClavicle ? ROW : index >= count * ROW + 6 ? 3 : 0;
    if (distance > 0) groups[index] = group < 3 ? 6 : 7;
    return distance > 0 ? index - distance : -1;
  });
  return [groups, mirrors];
}

/** Returns the layout of the blocks: the spine is a chain, of which neck and clavicles are the last link. */
export function bodyLayout({ kinds }: BodyExtension): ChannelLayout {
  const chest = kinds.lastIndexOf("spine");
  return createLayout(
    kinds.map((kind) => PRIOR_CHANNELS[kind]),
    kinds.map((kind, joint) => (kind === "spine" ? joint - 1 : chest)),
    kinds.map((_, joint) => joint - 1),
  );
}

/** Returns the inverses of the weights: the lever arm about each axis of what a joint carries. */
export function inverseBodyWeights({ kinds, offsets, ends }: BodyExtension): Float64Array {
  const count = kinds.length;
  const [left, right] = [ends.slice(3, 6), ends.slice(6, 9)];
  if (kinds.at(-1) === "right clavicle") {
    for (let i = 0; i < 3; i++) {
      left[i] += offsets[(count - 2) * 3 + i];
      right[i] += offsets[(count - 1) * 3 + i];
    }
  }
  const radius = Math.hypot(left[0] - right[0], left[1] - right[1], left[2] - right[2]) / 2;
  const arm = left.map((value, i) => (value + right[i]) / 2);
  const inverses = new Float64Array(count * 9);
  for (let joint = count - 1; joint >= 0; joint--) {
    const kind = kinds[joint];
    if (kind === "spine") {
      writeInverseWeight(inverses, joint * 9, arm, radius);
      for (let i = 0; i < 3; i++) arm[i] += offsets[joint * 3 + i];
    } else {
      const end = kind === "neck" ? 0 : kind === "left clavicle" ? 1 : 2;
      writeInverseWeight(inverses, joint * 9, ends.slice(end * 3, end * 3 + 3), 0);
    }
  }
  return inverses;
}

/** Writes the inverse weight of a joint that carries a point at `arm`, and others around it at `radius`. */
function writeInverseWeight(out: Float64Array, at: number, arm: Float64Array, radius: number): void {
  const square = TWIST_RADIUS_M ** 2 + radius ** 2;
  const size = length(arm, 0);
  const along = 1 / Math.sqrt(square),
    across = 1 / Math.sqrt(square + size * size);
  for (let row = 0; row < 3; row++)
    for (let column = 0; column < 3; column++)
      out[at + row * 3 + column] =
        (row === column ? across : 0) + ((along - across) * arm[row] * arm[column]) / Math.max(size, 1e-9) ** 2;
}
