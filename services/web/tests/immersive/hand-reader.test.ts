import { Matrix4, Vector3 } from "three";
import { beforeEach, expect, test } from "vitest";
import { HandReader, type PoseSource } from "../../src/immersive/hand-reader";

/** Spaces are tokens; the frame knows their poses. */
type Space = XRSpace & XRJointSpace;
const ROOM = {} as XRReferenceSpace;

let poses: Map<unknown, Matrix4>;
let reader: HandReader;
let now: number;

beforeEach(() => {
  [poses, reader, now] = [new Map(), new HandReader(), 0];
});

const frame = {
  getPose: (space: XRSpace) => poseOf(space) as XRPose,
  getJointPose: (space: XRSpace) => poseOf(space) as XRJointPose,
} as PoseSource;

function poseOf(space: XRSpace): unknown {
  const matrix = poses.get(space);
  if (!matrix) return null;
  return {
    transform: { matrix: new Float32Array(matrix.elements), position: new Vector3().setFromMatrixPosition(matrix) },
  };
}

function space(x: number, y: number, z: number): Space {
  const token = {} as Space;
  poses.set(token, new Matrix4().setPosition(x, y, z));
  return token;
}

function controller(handedness: XRHandedness, trigger = 0, more: Partial<XRInputSource> = {}): XRInputSource {
  const buttons = [trigger, 0, 0, 0, 0, 0].map((value) => ({ value }));
  return {
    handedness,
    targetRayMode: "tracked-pointer",
    targetRaySpace: space(0, 1, 0),
    gripSpace: space(0, 1, 0.1),
    gamepad: { axes: [0, 0, 0, 0], buttons } as unknown as Gamepad,
    profiles: [],
    ...more,
  } as XRInputSource;
}

/** A tracked hand whose index finger is this far from its thumb, in metres. */
function trackedHand(distance: number): XRInputSource {
  const hand = new Map<XRHandJoint, XRJointSpace>([
    ["wrist", space(0, 1, 0)],
    ["thumb-tip", space(0, 1, -0.1)],
    ["index-finger-tip", space(distance, 1, -0.1)],
    ["middle-finger-tip", space(0.1, 1, -0.1)],
  ]);
  return controller("left", 0, { hand: hand as unknown as XRHand });
}

const read = (...sources: XRInputSource[]) => reader.read(frame, ROOM, sources, now);

test("a controller grips where its grip is, and points along its ray", () => {
  const source = controller("right", 1);
  poses.set(source.targetRaySpace, new Matrix4().makeRotationY(Math.PI / 2).setPosition(0, 1, 0));
  const [hand] = read(source).hands;
  expect([hand.name, hand.isClosed, hand.joints]).toEqual(["right", true, []]);
  expect(hand.position.distanceTo(new Vector3(0, 1, 0.1))).toBeLessThan(1e-6);
  expect(hand.origin.distanceTo(new Vector3(0, 1, 0))).toBeLessThan(1e-6);
  expect(hand.direction.distanceTo(new Vector3(-1, 0, 0))).toBeLessThan(1e-6);
});

test("a tracked hand grips between thumb and index finger", () => {
  const [open] = read(trackedHand(0.06)).hands;
  expect([open.isClosed, open.joints.length]).toEqual([false, 4]);
  const [closed] = read(trackedHand(0.01)).hands;
  expect(closed.isClosed).toBe(true);
  expect(closed.position.distanceTo(new Vector3(0.005, 1, -0.1))).toBeLessThan(1e-6);
});

test("buttons are read once per press", () => {
  const source = controller("right");
  const { buttons } = source.gamepad as unknown as { buttons: { value: number }[] };
  buttons[4].value = 1;
  expect([read(source).actions, read(source).actions]).toEqual([["next performer"], []]);
});

test("a hand that is briefly not tracked stays where it was", () => {
  const source = controller("left", 1);
  read(source);
  poses.clear();
  now = 300;
  expect(read(source).hands.map(({ isClosed }) => isClosed)).toEqual([true]);
  now = 500;
  expect(read(source).hands).toEqual([]);
});

test("a controller that was put down is gone at once", () => {
  read(controller("left", 1));
  expect(read().hands).toEqual([]);
});

test("gazes and second sources of the same hand are left out", () => {
  const gaze = controller("none", 1, { targetRayMode: "gaze" });
  const [first, second] = [controller("left", 1), controller("left", 0)];
  expect(read(gaze, first, second).hands.map(({ source }) => source)).toEqual([first]);
});
