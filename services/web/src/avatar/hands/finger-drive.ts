/**
 * Fingers of an avatar. The bones of index to little finger lie along the hand where a performer's fingers are
 * straight, whatever the file's rest pose is; a thumb keeps the rest of its file, unless that is no thumb's direction.
 */
import { type Object3D, Quaternion, Vector3 } from "three";
import {
  FINGER_DIRECTION,
  FINGERS,
  type Hands,
  type HandsPose,
  THUMB_DIRECTION,
  VRM_NAMES,
  WRISTS,
} from "../../motion/hands";
import { T_POSE_TO_REST } from "../../motion/humanoid";
import type { RestBone } from "../rest-pose";
import { type JointTurn, planChain } from "./finger-plan";

/** Largest angle of a thumb's bone at rest from the direction of a performer's thumb. */
const MAX_THUMB_ANGLE_RAD = (50 * Math.PI) / 180;
/** Smallest angle between the knuckles and those of a level hand from which fingers bend about the avatar's own. */
const MIN_PALM_TWIST_RAD = (30 * Math.PI) / 180;
const FORWARD = new Vector3(0, 0, 1);

/** A model's nodes and rest, as far as they concern fingers. */
export interface FingerModel {
  readonly nodes: ReadonlyMap<string, Object3D>;
  readonly rest: {
    readonly bones: ReadonlyMap<string, RestBone>;
    readonly fingerTips: ReadonlyMap<string, Vector3>;
  };
}

/** Rotation of a node: its own rest, then the performer's, then into its parent's frame. */
interface FingerBone {
  readonly node: Object3D;
  readonly rest: Quaternion;
  readonly preRotation: Quaternion;
  readonly postRotation: Quaternion;
}

/** Bones of a chain, and the rotation from the wrist's frame to that in which they turn. */
interface Finger {
  readonly chain: number;
  readonly bones: readonly FingerBone[];
  readonly frame: Quaternion;
}

/** A bone, and the joints of the performer that it turns with. */
interface BoneTurn {
  readonly bone: FingerBone;
  readonly frame: Quaternion;
  readonly turns: readonly JointTurn[];
}

export class FingerDrive {
  readonly #fingers: readonly Finger[];
  #hands: Hands | null = null;
  #turns: readonly BoneTurn[] = [];

  /** @param alignments rotations of the hands from the file's rest to the figure's T-pose, by bone */
  constructor(model: FingerModel, alignments: ReadonlyMap<string, Quaternion>) {
    this.#fingers = ["left", "right"].flatMap((side, index) =>
      createFingers(model, index, alignments.get(`${side}Hand`) ?? new Quaternion()),
    );
    this.#reset();
  }

  /** Turn the fingers as those of a performer; null returns them to the file's rest. */
  apply(pose: HandsPose | null): void {
    const hands = pose?.hands ?? null;
    if (hands !== this.#hands) this.#plan(hands);
    if (!pose) return;
    const { values } = pose;
    for (const { bone, frame, turns } of this.#turns) {
      sum.identity();
      for (const { joints, share } of turns) {
        vector.set(0, 0, 0);
        for (const joint of joints) vector.add(joined.fromArray(values, joint * 3));
        vector.multiplyScalar(share / joints.length).applyQuaternion(frame);
        const angle = vector.length();
        if (angle > 0) sum.multiply(turn.setFromAxisAngle(vector.divideScalar(angle), angle));
      }
      bone.node.quaternion.copy(bone.preRotation).multiply(sum).multiply(bone.postRotation);
    }
  }

  #plan(hands: Hands | null): void {
    this.#hands = hands;
    this.#turns = [];
    this.#reset();
    if (!hands) return;
    this.#turns = this.#fingers.flatMap(({ chain, bones, frame }) => {
      const side = Math.floor(chain / FINGERS.length);
      const sameSide = this.#fingers.filter((one) => Math.floor(one.chain / FINGERS.length) === side);
      const isMitten = sameSide.filter((one) => one.chain % FINGERS.length > 0).length === 1;
      return planChain(hands, chain, bones.length, isMitten).map((turns, at) => ({ bone: bones[at], frame, turns }));
    });
  }

  #reset(): void {
    for (const { bones } of this.#fingers) for (const { node, rest } of bones) node.quaternion.copy(rest);
  }
}

const sum = new Quaternion();
const turn = new Quaternion();
const vector = new Vector3();
const joined = new Vector3();

/** Return the fingers of a side that the model has. */
function createFingers({ nodes, rest }: FingerModel, side: number, hand: Quaternion): Finger[] {
  const [w, x, y, z] = T_POSE_TO_REST.subarray(WRISTS[side] * 4);
  const toTPose = new Quaternion(x, y, z, w).invert();
  const along = new Vector3(...FINGER_DIRECTION).applyQuaternion(toTPose);
  const chains = VRM_NAMES.slice(side * FINGERS.length, (side + 1) * FINGERS.length).map((names) =>
    nestedBones(names, nodes, rest.bones),
  );
  const twist = palmTwist(
    chains.slice(1).flatMap(([first]) => (first ? [(rest.bones.get(first) as RestBone).position] : [])),
    hand,
    along,
  );
  const frame = twist.clone().multiply(toTPose);
  return chains.flatMap((names, finger) => {
    if (names.length === 0) return [];
    const isThumb = finger === 0;
    const direction = isThumb ? new Vector3(...THUMB_DIRECTION).applyQuaternion(frame) : along;
    let alignment = hand;
    const bones = names.map((name, at): FingerBone => {
      const { position, rotation, parentRotation } = rest.bones.get(name) as RestBone;
      const end = rest.bones.get(names[at + 1])?.position ?? rest.fingerTips.get(name);
      const above = alignment;
      const own = end?.clone().sub(position).normalize().applyQuaternion(above);
      if (own && own.lengthSq() > 0 && (!isThumb || own.angleTo(direction) > MAX_THUMB_ANGLE_RAD))
        alignment = new Quaternion().setFromUnitVectors(own, direction).multiply(above);
      return {
        node: nodes.get(name) as Object3D,
        rest: parentRotation.clone().invert().multiply(rotation),
        preRotation: above.clone().multiply(parentRotation).invert(),
        postRotation: alignment.clone().multiply(rotation),
      };
    });
    return [{ chain: side * FINGERS.length + finger, bones, frame }];
  });
}

/** Return those bones of a chain that the model has, each below the previous one. */
function nestedBones(
  names: readonly string[],
  nodes: ReadonlyMap<string, Object3D>,
  bones: ReadonlyMap<string, RestBone>,
): string[] {
  const found: string[] = [];
  for (const name of names) {
    const rest = bones.get(name);
    // The rotation of a bone that is scaled to nothing is not defined.
    if (!rest || !Number.isFinite(rest.rotation.lengthSq() + rest.parentRotation.lengthSq())) continue;
    const above = found.length > 0 ? nodes.get(found[found.length - 1]) : null;
    let node = nodes.get(name)?.parent ?? null;
    while (above && node && node !== above) node = node.parent;
    if (!above || node) found.push(name);
  }
  return found;
}

/** Return the rotation about the hand from a level one, whose index finger is in front, to one with these knuckles. */
function palmTwist(knuckles: readonly Vector3[], hand: Quaternion, along: Vector3): Quaternion {
  const twist = new Quaternion();
  if (knuckles.length < 2) return twist;
  const across = knuckles[0]
    .clone()
    .sub(knuckles[knuckles.length - 1])
    .applyQuaternion(hand)
    .projectOnPlane(along);
  if (across.lengthSq() === 0) return twist;
  const angle = Math.atan2(new Vector3().crossVectors(FORWARD, across).dot(along), across.dot(FORWARD));
  return Math.abs(angle) > MIN_PALM_TWIST_RAD ? twist.setFromAxisAngle(along, angle) : twist;
}
