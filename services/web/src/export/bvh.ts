/** BVH export, equivalent to `motion/bvh_writer.py` in Python. */

import { applyPlacement } from "../motion/placement";
import { restPose } from "../motion/skeleton";
import { ExportSkeleton } from "./export-skeleton";
import { FRAMES_PER_STEP, frameValuesAt, type IncrementalTask, poseAt, type SampledMotion } from "./sampled-motion";

const CENTIMETRES_PER_METRE = 100;
const DEGREES_PER_RADIAN = 180 / Math.PI;

const encoder = new TextEncoder();

/**
 * Write a motion as BVH in centimetres, y up, facing z, with H-Anim joint names and the I-pose as rest pose. The root
 * has six channels with absolute positions on the shared stage, so that the files of several performers stand side by
 * side. All joints rotate in the order z, x, y. Lengths and angles have 6 decimals.
 */
export function* writeBvh(motion: SampledMotion): IncrementalTask<Uint8Array<ArrayBuffer>[]> {
  const { fps, frames, placement: place } = motion;
  const frameTime = Number((1 / fps).toPrecision(10));
  const skeleton = new ExportSkeleton(motion.figure, motion.extension?.extension, motion.hands?.hands);
  const parts = [
    encoder.encode(
      [...formatHierarchy(skeleton), "MOTION", `Frames: ${frames}`, `Frame Time: ${frameTime}`, ""].join("\n"),
    ),
  ];
  const values = new Float64Array(3 + skeleton.count * 3);
  const rotations = new Float64Array(skeleton.count * 4);
  const pose = restPose();
  let rows = "";
  for (let frame = 0; frame < frames; frame++) {
    skeleton.rotations(applyPlacement(poseAt(motion, frame, pose), place), frameValuesAt(motion, frame), rotations);
    for (let axis = 0; axis < 3; axis++) values[axis] = pose.root[axis] * CENTIMETRES_PER_METRE;
    for (let joint = 0; joint < skeleton.count; joint++) toEulerZxy(values, 3 + joint * 3, rotations, joint * 4);
    rows += `${formatRow(values)}\n`;
    if (frame % FRAMES_PER_STEP !== FRAMES_PER_STEP - 1 && frame !== frames - 1) continue;
    parts.push(encoder.encode(rows));
    rows = "";
    yield frame / frames;
  }
  return parts;
}

/**
 * Write the Euler angles of a unit quaternion, in degrees: about z, then x, then y, each about the axis rotated by the
 * ones before. The angle about x is within 90 degrees; at 90 the angle about y is zero.
 */
export function toEulerZxy(out: Float64Array, outAt: number, q: Float64Array, at: number): void {
  const w = q[at],
    x = q[at + 1],
    y = q[at + 2],
    z = q[at + 3];
  const sine = 2 * (w * x + y * z);
  const across = 2 * (w * y - x * z),
    along = 1 - 2 * (x * x + y * y);
  const locked = Math.abs(sine) > 1 - 1e-12;
  out[outAt] =
    DEGREES_PER_RADIAN *
    (locked
      ? Math.atan2(2 * (x * y + w * z), 1 - 2 * (y * y + z * z))
      : Math.atan2(2 * (w * z - x * y), 1 - 2 * (x * x + z * z)));
  out[outAt + 1] = DEGREES_PER_RADIAN * Math.atan2(sine, Math.hypot(across, along));
  out[outAt + 2] = locked ? 0 : DEGREES_PER_RADIAN * Math.atan2(across, along);
}

function formatHierarchy({ names, parents, offsets, tips }: ExportSkeleton): string[] {
  const lines = ["HIERARCHY"];
  const depths: number[] = [];
  let open = 0;
  const close = (depth: number) => {
    while (open > depth) lines.push(`${"\t".repeat(--open)}}`);
  };
  names.forEach((name, joint) => {
    const depth = joint === 0 ? 0 : depths[parents[joint]] + 1;
    depths.push(depth);
    close(depth);
    const indent = "\t".repeat(depth);
    const [kind, channels] = joint === 0 ? ["ROOT", "6 Xposition Yposition Zposition"] : ["JOINT", "3"];
    const offset = joint === 0 ? [0, 0, 0] : toCentimetres(offsets, joint);
    lines.push(
      `${indent}${kind} ${name}`,
      `${indent}{`,
      `${indent}\tOFFSET ${formatRow(offset)}`,
      `${indent}\tCHANNELS ${channels} Zrotation Xrotation Yrotation`,
    );
    open = depth + 1;
    const tip = tips.get(joint);
    if (tip)
      lines.push(
        `${indent}\tEnd Site`,
        `${indent}\t{`,
        `${indent}\t\tOFFSET ${formatRow(toCentimetres(tip, 0))}`,
        `${indent}\t}`,
      );
  });
  close(0);
  return lines;
}

function toCentimetres(vectors: Float64Array, joint: number): number[] {
  return [0, 1, 2].map((axis) => vectors[joint * 3 + axis] * CENTIMETRES_PER_METRE);
}

function formatRow(values: ArrayLike<number>): string {
  let text = values[0].toFixed(6);
  for (let i = 1; i < values.length; i++) text += ` ${values[i].toFixed(6)}`;
  return text;
}
