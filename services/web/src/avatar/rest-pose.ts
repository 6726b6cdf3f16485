/** Measurements of a model's rest pose: facing, bone positions, and the points that touch the floor. */
import { type BufferAttribute, type Group, Mesh, type Object3D, Quaternion, SkinnedMesh, Vector3 } from "three";
import { VRM_NAMES } from "../motion/hands";
import { BONES } from "../motion/humanoid";
import { DRIVEN_BONES } from "./bone-orientations";

const UP = new Vector3(0, 1, 0);
export const FINGER_BONES: readonly string[] = VRM_NAMES.flat();
/** Position of the ball in a foot without toes, as a share of the way from ankle to front. */
const BALL_SHARE = 0.7;

/** Number of vertices of a mesh of which the highest is sought. */
const MAX_MEASURED_VERTICES = 100_000;

/** A bone at rest, in the frame of the model facing z with y up; lengths are the file's. */
export interface RestBone {
  position: Vector3;
  /** Orientation of its node. */
  rotation: Quaternion;
  /** Orientation of the node's parent in the file. */
  parentRotation: Quaternion;
}

export interface RestMeasurements {
  /** Rotation from the file's frame to facing z, y up. */
  facing: Quaternion;
  bones: ReadonlyMap<string, RestBone>;
  /** Height of the soles. */
  soleHeight: number;
  /** Height of the highest vertex, of head or hair. */
  topHeight: number;
  /** Points under heel and ball for each foot bone, in its node's frame. */
  solePoints: ReadonlyMap<string, readonly Vector3[]>;
  /** Length from each hand bone to the finger tips, as far as its mesh reaches. */
  handLengths: ReadonlyMap<string, number>;
  /** Positions of the ends of finger bones that have a node there. */
  fingerTips: ReadonlyMap<string, Vector3>;
}

/**
 * Measure the model in `stand`, which is at the origin and is rotated by this function; `nodes` are the bones' nodes.
 */
export function measureRest(stand: Group, nodes: ReadonlyMap<string, Object3D>): RestMeasurements {
  stand.quaternion.identity();
  stand.updateMatrixWorld(true);
  const facing = facingOf(nodes);
  stand.quaternion.copy(facing);
  stand.updateMatrixWorld(true);
  const bones = new Map<string, RestBone>();
  for (const bone of [...DRIVEN_BONES, ...FINGER_BONES]) {
    const node = nodes.get(bone);
    if (node)
      bones.set(bone, {
        position: positionOf(node),
        rotation: node.getWorldQuaternion(new Quaternion()),
        parentRotation: (node.parent ?? stand).getWorldQuaternion(new Quaternion()),
      });
  }
  const { clouds, top } = collectVertices(stand, nodes);
  const feet = SIDES.map((side) => [...(clouds.get(`${side}Foot`) ?? []), ...(clouds.get(`${side}Toes`) ?? [])]);
  const all = feet.flat();
  const lowest =
    all.length > 0
      ? Math.min(...all.map(({ y }) => y))
      : Math.min(
          ...SIDES.map((side) => positionOf(nodes.get(`${side}Toes`) ?? (nodes.get(`${side}Foot`) as Object3D)).y),
        );
  return {
    facing,
    bones,
    soleHeight: lowest,
    topHeight: top,
    solePoints: new Map(SIDES.map((side, at) => [`${side}Foot`, solePointsOf(side, nodes, feet[at], lowest)])),
    handLengths: new Map(
      SIDES.map((side) => [`${side}Hand`, handLength(side, nodes, clouds.get(`${side}Hand`) ?? [])]),
    ),
    fingerTips: new Map(
      FINGER_BONES.flatMap((bone): [string, Vector3][] => {
        const end = nodes.get(bone)?.children.find((child) => !(child instanceof Mesh));
        return end ? [[bone, positionOf(end)]] : [];
      }),
    ),
  };
}

const SIDES = ["left", "right"] as const;
type Side = (typeof SIDES)[number];

/**
 * Derived from the left side of the hips and the direction to the head: some files face away, lie on the back or
 * sideways.
 */
function facingOf(nodes: ReadonlyMap<string, Object3D>): Quaternion {
  const at = (bone: string) => positionOf(nodes.get(bone) as Object3D);
  const upward = at("head").sub(at("hips"));
  const up = nearestAxis(upward);
  const upright = new Quaternion().setFromUnitVectors(up, UP);
  const left = at("leftUpperLeg")
    .sub(at("rightUpperLeg"))
    .add(at("leftUpperArm").sub(at("rightUpperArm")))
    .applyQuaternion(upright)
    .setY(0);
  return new Quaternion().setFromAxisAngle(UP, Math.atan2(left.z, left.x)).multiply(upright);
}

function nearestAxis({ x, y, z }: Vector3): Vector3 {
  const size = [x, y, z].map(Math.abs);
  const largest = size.indexOf(Math.max(...size));
  return new Vector3().setComponent(largest, Math.sign([x, y, z][largest]) || 1);
}

function solePointsOf(
  side: Side,
  nodes: ReadonlyMap<string, Object3D>,
  cloud: readonly Vector3[],
  floor: number,
): Vector3[] {
  const foot = nodes.get(`${side}Foot`) as Object3D;
  const toes = nodes.get(`${side}Toes`);
  const ankle = positionOf(foot);
  const front = cloud.length > 0 ? Math.max(...cloud.map(({ z }) => z)) : ankle.z;
  const back = cloud.length > 0 ? Math.min(...cloud.map(({ z }) => z)) : ankle.z;
  const ball = toes ? positionOf(toes) : ankle.clone().setZ(ankle.z + BALL_SHARE * (front - ankle.z));
  return [ankle.clone().setZ(back), ball].map((place) => foot.worldToLocal(place.setY(floor)));
}

function handLength(side: Side, nodes: ReadonlyMap<string, Object3D>, cloud: readonly Vector3[]): number {
  const hand = positionOf(nodes.get(`${side}Hand`) as Object3D);
  return Math.max(0, ...cloud.map((place) => place.distanceTo(hand)));
}

/**
 * Return the vertices of hands and feet in the rest pose, by the bone with the largest weight, and the height of the
 * highest vertex. Of a large mesh only some others than those of hands and feet are looked at.
 */
function collectVertices(
  stand: Group,
  nodes: ReadonlyMap<string, Object3D>,
): { clouds: Map<string, Vector3[]>; top: number } {
  let top = positionOf(nodes.get("head") as Object3D).y;
  const bones = new Map(
    [...nodes].filter(([bone]) => (BONES as readonly string[]).includes(bone)).map(([bone, node]) => [node, bone]),
  );
  const carriers = new Map<Object3D, string | null>();
  const carrierOf = (node: Object3D | null): string | null => {
    if (!node) return null;
    let carrier = carriers.get(node);
    if (carrier === undefined) carriers.set(node, (carrier = bones.get(node) ?? carrierOf(node.parent)));
    return carrier;
  };
  const clouds = new Map<string, Vector3[]>();
  stand.traverse((mesh) => {
    if (!(mesh instanceof Mesh)) return;
    const { position, skinIndex, skinWeight } = mesh.geometry.attributes as Record<string, BufferAttribute | undefined>;
    const step = Math.ceil((position?.count ?? 0) / MAX_MEASURED_VERTICES);
    for (let i = 0; i < (position?.count ?? 0); i++) {
      const skinned = mesh instanceof SkinnedMesh && skinIndex && skinWeight;
      const carrier = carrierOf(skinned ? mesh.skeleton.bones[dominantBone(skinIndex, skinWeight, i)] : mesh);
      const isEndOfLimb = carrier !== null && /Hand|Foot|Toes/.test(carrier);
      if (!isEndOfLimb && i % step !== 0) continue;
      const place = mesh.getVertexPosition(i, new Vector3()).applyMatrix4(mesh.matrixWorld);
      // A prop in a hand is no part of the body.
      if (!isEndOfLimb) {
        top = Math.max(top, place.y);
        continue;
      }
      const cloud = clouds.get(carrier);
      if (cloud) cloud.push(place);
      else clouds.set(carrier, [place]);
    }
  });
  return { clouds, top };
}

/** Return the index of the bone with the largest weight on a vertex. */
function dominantBone(indices: BufferAttribute, weights: BufferAttribute, vertex: number): number {
  let largest = 0;
  for (let k = 1; k < 4; k++) if (weights.getComponent(vertex, k) > weights.getComponent(vertex, largest)) largest = k;
  return indices.getComponent(vertex, largest);
}

function positionOf(node: Object3D): Vector3 {
  return new Vector3().setFromMatrixPosition(node.matrixWorld);
}
