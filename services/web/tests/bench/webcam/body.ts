/** Error of the whole body in the benchmark of the webcam: directions of bones, against the person in each picture. */
import { Vector3 } from "three";
import { fromRotationVector } from "../../../src/motion/rotation";
import { createWorldTransforms, JOINTS, restPose, worldTransforms } from "../../../src/motion/skeleton";
import { bodyFigure } from "../../../src/webcam/body-figure";
import { unpackSample } from "../../../src/wire/fixed-message";
import { performancePose } from "../../webcam/performance";
import { Person } from "../../webcam/person";
import type { BodySample, PictureSample } from "./recording";

const UNITS_PER_RADIAN = 32767 / Math.PI;
/** Samples whose time differs by more from that of a picture are not its own, in milliseconds. */
const MAX_DIFFERENCE_MS = 8;

/** Bones of arms and legs by the joints at their ends. */
const BONES = ["l", "r"].flatMap((side) =>
  [
    ["shoulder", "elbow"],
    ["elbow", "wrist"],
    ["hip", "knee"],
    ["knee", "ankle"],
  ].map(([from, to]) => [`${side}_${from}`, `${side}_${to}`] as const),
);

type FindJoint = (name: string) => Vector3;

function directions(find: FindJoint): Vector3[] {
  return BONES.map(([from, to]) => find(to).clone().sub(find(from)).normalize());
}

/** Return the joints of the figure in a sample. */
function jointsOf({ bytes }: BodySample): FindJoint {
  const { rotations } = unpackSample(Uint8Array.from(bytes));
  const pose = restPose();
  JOINTS.forEach((_, joint) => {
    const [x, y, z] = [0, 1, 2].map((axis) => rotations[joint * 3 + axis] / UNITS_PER_RADIAN);
    fromRotationVector(pose.rotations, joint * 4, x, y, z);
  });
  const { positions } = worldTransforms(bodyFigure(), pose, createWorldTransforms());
  return (name) => new Vector3().fromArray(positions, JOINTS.indexOf(name) * 3);
}

/** Return the angles in degrees between the bones of all samples and those of the person in their pictures. */
export function bodyErrors(
  samples: readonly BodySample[],
  pictures: readonly PictureSample[],
  times: readonly number[],
): number[] {
  const person = new Person();
  return samples.flatMap((sample) => {
    const picture = pictures.find(({ takenAt }) => Math.abs(takenAt - sample.sampledAt) <= MAX_DIFFERENCE_MS);
    const time = picture && times[picture.number];
    if (time === undefined) return [];
    person.apply(performancePose(time));
    const expected = directions((name) => person.position(name));
    return directions(jointsOf(sample)).map((bone, index) => (bone.angleTo(expected[index]) * 180) / Math.PI);
  });
}
