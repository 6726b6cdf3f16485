/** Motion as BVH, as the Python room's `motion/writers.py` writes it. */

import { bring } from "../motion/performer";
import { JOINT_COUNT, JOINTS, PARENTS, restPose, TIPS } from "../motion/skeleton";
import { type Dance, poseOf, STRIDE, type Work } from "./dance";

const CENTIMETRES = 100;
const DEGREES = 180 / Math.PI;

const encoder = new TextEncoder();

/**
 * `dance` as BVH in centimetres, y up, facing z, with H-Anim joint names and its I-pose as the rest pose. The root has six
 * channels, whose positions are absolute: on the stage that all dancers share, so that the files of several stand beside each
 * other. All joints turn in the order z, x, y. Lengths and angles have 6 decimals.
 */
export function* writeBvh(dance: Dance): Work<Uint8Array<ArrayBuffer>[]> {
  const { fps, frames, place } = dance;
  const frameTime = Number((1 / fps).toPrecision(10));
  const parts = [encoder.encode([...hierarchy(dance), "MOTION", `Frames: ${frames}`, `Frame Time: ${frameTime}`, ""].join("\n"))];
  const values = new Float64Array(3 + JOINT_COUNT * 3);
  const pose = restPose();
  let rows = "";
  for (let frame = 0; frame < frames; frame++) {
    const { root, rotations } = bring(poseOf(dance, frame, pose), place);
    for (let axis = 0; axis < 3; axis++) values[axis] = root[axis] * CENTIMETRES;
    for (let joint = 0; joint < JOINT_COUNT; joint++) eulerZxy(values, 3 + joint * 3, rotations, joint * 4);
    rows += `${row(values)}\n`;
    if (frame % STRIDE !== STRIDE - 1 && frame !== frames - 1) continue;
    parts.push(encoder.encode(rows));
    rows = "";
    yield frame / frames;
  }
  return parts;
}

/**
 * Angles in degrees of a unit quaternion, to be turned about z, then x, then y, each about the axis the ones before have
 * turned; the one about x lies within 90 degrees. Where x is at 90, y is zero.
 */
export function eulerZxy(out: Float64Array, outAt: number, q: Float64Array, at: number): void {
  const w = q[at], x = q[at + 1], y = q[at + 2], z = q[at + 3];
  const sine = 2 * (w * x + y * z);
  const across = 2 * (w * y - x * z), along = 1 - 2 * (x * x + y * y);
  const locked = Math.abs(sine) > 1 - 1e-12;
  out[outAt] = DEGREES * (locked ? Math.atan2(2 * (x * y + w * z), 1 - 2 * (y * y + z * z)) : Math.atan2(2 * (w * z - x * y), 1 - 2 * (x * x + z * z)));
  out[outAt + 1] = DEGREES * Math.atan2(sine, Math.hypot(across, along));
  out[outAt + 2] = locked ? 0 : DEGREES * Math.atan2(across, along);
}

function hierarchy({ figure }: Dance): string[] {
  const lines = ["HIERARCHY"];
  const depths: number[] = [];
  let open = 0;
  const close = (depth: number) => {
    while (open > depth) lines.push(`${"\t".repeat(--open)}}`);
  };
  JOINTS.forEach((name, joint) => {
    const depth = joint === 0 ? 0 : depths[PARENTS[joint]] + 1;
    depths.push(depth);
    close(depth);
    const indent = "\t".repeat(depth);
    const [kind, channels] = joint === 0 ? ["ROOT", "6 Xposition Yposition Zposition"] : ["JOINT", "3"];
    const offset = joint === 0 ? [0, 0, 0] : lengths(figure.offsets, joint);
    lines.push(`${indent}${kind} ${name}`, `${indent}{`, `${indent}\tOFFSET ${row(offset)}`, `${indent}\tCHANNELS ${channels} Zrotation Xrotation Yrotation`);
    open = depth + 1;
    if (TIPS.includes(joint)) lines.push(`${indent}\tEnd Site`, `${indent}\t{`, `${indent}\t\tOFFSET ${row(lengths(figure.tips, joint))}`, `${indent}\t}`);
  });
  close(0);
  return lines;
}

function lengths(vectors: Float64Array, joint: number): number[] {
  return [0, 1, 2].map((axis) => vectors[joint * 3 + axis] * CENTIMETRES);
}

function row(values: ArrayLike<number>): string {
  let text = values[0].toFixed(6);
  for (let i = 1; i < values.length; i++) text += ` ${values[i].toFixed(6)}`;
  return text;
}
