/** Reads the controllers and tracked hands of an immersive session, in the frame of the room. */
import { Matrix4, Vector3 } from "three";
import type { HandName } from "../input/hand";
import { Controller, type ImmersiveAction } from "./controller";
import { Pinch } from "./pinch";

/** A controller or a tracked hand. Metres. */
export interface RoomHand {
  readonly name: HandName;
  readonly source: XRInputSource;
  /** Where it grips: the controller's grip, or between the tips of thumb and index finger. */
  readonly position: Vector3;
  readonly origin: Vector3;
  readonly direction: Vector3;
  readonly isClosed: boolean;
  /** Joints of a tracked hand; none of a controller. */
  readonly joints: readonly Vector3[];
}

/** Part of a frame that is read. */
export type PoseSource = Pick<XRFrame, "getPose" | "getJointPose">;

/** A hand whose tracking is lost for at most this time stays where it was, in milliseconds. */
const TRACKING_GAP_MS = 400;

interface Device {
  readonly source: XRInputSource;
  readonly controller: Controller;
  readonly pinch: Pinch;
  last: RoomHand | null;
  trackedAt: number;
}

export class HandReader {
  readonly #devices = new Map<HandName, Device>();

  /**
   * Read all hands, once per frame; `now` is in milliseconds. Return those that are tracked, at most one of each name,
   * and the actions that begin now.
   */
  read(
    frame: PoseSource,
    space: XRReferenceSpace,
    sources: Iterable<XRInputSource>,
    now: number,
  ): { hands: RoomHand[]; actions: ImmersiveAction[] } {
    const actions: ImmersiveAction[] = [];
    const present = new Map<HandName, Device>();
    for (const source of sources) {
      const name = source.handedness;
      if (source.targetRayMode !== "tracked-pointer" || present.has(name)) continue;
      const known = this.#devices.get(name);
      const device = known?.source === source ? known : createDevice(source);
      present.set(name, device);
      const tracked = readHand(device, frame, space, actions);
      if (tracked) [device.last, device.trackedAt] = [tracked, now];
      else if (now - device.trackedAt > TRACKING_GAP_MS) device.last = null;
    }
    this.#devices.clear();
    for (const [name, device] of present) this.#devices.set(name, device);
    return { hands: [...present.values()].flatMap(({ last }) => last ?? []), actions };
  }
}

function createDevice(source: XRInputSource): Device {
  return { source, controller: new Controller(), pinch: new Pinch(), last: null, trackedAt: -Infinity };
}

/** Return the hand of a device, null while it is not tracked, and add its actions to `actions`. */
function readHand(
  { source, controller, pinch }: Device,
  frame: PoseSource,
  space: XRReferenceSpace,
  actions: ImmersiveAction[],
): RoomHand | null {
  const ray = frame.getPose(source.targetRaySpace, space);
  if (!ray) return null;
  const matrix = new Matrix4().fromArray(ray.transform.matrix);
  const pointing = {
    name: source.handedness,
    source,
    origin: new Vector3().setFromMatrixPosition(matrix),
    direction: new Vector3().setFromMatrixColumn(matrix, 2).negate().normalize(),
  };
  if (source.hand) {
    const joints = readJoints(source.hand, frame, space);
    const [thumb, index, middle] = [
      joints.get("thumb-tip"),
      joints.get("index-finger-tip"),
      joints.get("middle-finger-tip"),
    ];
    if (!thumb || !index || !middle) return null;
    actions.push(...pinch.update({ thumb, index, middle }));
    const position = thumb.clone().lerp(index, 0.5);
    return { ...pointing, position, isClosed: pinch.isClosed, joints: [...joints.values()] };
  }
  const grip = source.gripSpace ? frame.getPose(source.gripSpace, space) : ray;
  if (!grip || !source.gamepad) return null;
  actions.push(...controller.update(source.gamepad));
  return { ...pointing, position: toVector(grip), isClosed: controller.isClosed, joints: [] };
}

function readJoints(hand: XRHand, frame: PoseSource, space: XRReferenceSpace): Map<XRHandJoint, Vector3> {
  const joints = new Map<XRHandJoint, Vector3>();
  for (const [name, joint] of hand) {
    const pose = frame.getJointPose?.(joint, space);
    if (pose) joints.set(name, toVector(pose));
  }
  return joints;
}

function toVector({ transform: { position } }: XRPose): Vector3 {
  return new Vector3(position.x, position.y, position.z);
}
