/** Hands as the viewer of an immersive session sees them: a sphere at each joint or grip, and a beam to the string. */
import {
  CylinderGeometry,
  Group,
  InstancedMesh,
  Matrix4,
  Mesh,
  MeshBasicMaterial,
  Quaternion,
  SphereGeometry,
  Vector3,
} from "three";
import type { HandGrip } from "../input/hand";
import type { RoomHand } from "./hand-reader";

/** Joints of a hand (WebXR Hand Input, 3.2). */
const MAX_JOINTS = 25;
const JOINT_RADIUS_M = 0.007;
const GRIP_RADIUS_M = 0.018;
const BEAM_RADIUS_M = 0.0016;
/** Length of the beam of a hand that points at nothing. */
const POINTER_LENGTH_M = 0.5;
type Colours = Readonly<Record<HandGrip["kind"], string>>;
const DARK_LOOK: Colours = { open: "#efe4cf", empty: "#8a8277", holding: "#f2b84b", asking: "#e2604f" };
const LIGHT_LOOK: Colours = { open: "#5d5040", empty: "#a3988a", holding: "#8f5200", asking: "#a52c2c" };

const UP = new Vector3(0, 1, 0);

class HandMarker {
  readonly group = new Group();
  readonly #material = new MeshBasicMaterial();
  readonly #joints = new InstancedMesh(new SphereGeometry(1, 12, 8), this.#material, MAX_JOINTS);
  readonly #beam = new Mesh(new CylinderGeometry(1, 1, 1, 6).translate(0, 0.5, 0), this.#material);
  readonly #matrix = new Matrix4();

  constructor(private readonly colours: Colours) {
    this.group.add(this.#joints, this.#beam);
    for (const part of [this.#joints, this.#beam]) part.frustumCulled = false;
  }

  /** `target` is the place in the room that the beam leads to; null for none. */
  update({ position, origin, direction, joints }: RoomHand, kind: HandGrip["kind"], target: Vector3 | null): void {
    this.#material.color.set(this.colours[kind]);
    const radius = joints.length > 0 ? JOINT_RADIUS_M : GRIP_RADIUS_M;
    const places = joints.length > 0 ? joints.slice(0, MAX_JOINTS) : [position];
    this.#joints.count = places.length;
    places.forEach((place, nth) => {
      this.#joints.setMatrixAt(nth, this.#matrix.makeScale(radius, radius, radius).setPosition(place));
    });
    this.#joints.instanceMatrix.needsUpdate = true;
    const from = target ? position : origin;
    const end = target ?? origin.clone().addScaledVector(direction, POINTER_LENGTH_M);
    const along = end.clone().sub(from);
    this.#beam.visible = kind !== "empty" && along.lengthSq() > 0;
    this.#beam.position.copy(from);
    this.#beam.quaternion.copy(new Quaternion().setFromUnitVectors(UP, along.clone().normalize()));
    this.#beam.scale.set(BEAM_RADIUS_M, along.length(), BEAM_RADIUS_M);
  }

  dispose(): void {
    this.#material.dispose();
    for (const part of [this.#joints, this.#beam]) part.geometry.dispose();
    this.#joints.dispose();
  }
}

export class HandMarkers {
  readonly group = new Group();
  readonly #markers: readonly HandMarker[];

  /** `isDark` is true if the markers are seen in the night look. */
  constructor(isDark: boolean) {
    this.#markers = [0, 1].map(() => new HandMarker(isDark ? DARK_LOOK : LIGHT_LOOK));
    this.group.add(...this.#markers.map(({ group }) => group));
  }

  /** Show the hands, of which `grips` says what they do, and `targetOf` where in the room the ring of a limb is. */
  update(hands: readonly RoomHand[], grips: readonly HandGrip[], targetOf: (limb: number) => Vector3 | null): void {
    this.#markers.forEach((marker, nth) => {
      const hand = hands[nth];
      marker.group.visible = hand !== undefined;
      if (!hand) return;
      const { kind, limb } = grips.find(({ name }) => name === hand.name) ?? { kind: "open", limb: null };
      marker.update(hand, kind, limb === null ? null : targetOf(limb));
    });
  }

  dispose(): void {
    for (const marker of this.#markers) marker.dispose();
  }
}
