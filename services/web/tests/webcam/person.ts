/**
 * A person for the fake camera: a simple human body of the standard figure's proportions, modelled here, whose pose is
 * known. It wears a shirt, trousers and shoes, and has a face, since the detector looks for one.
 */
import {
  Bone,
  CapsuleGeometry,
  Group,
  LatheGeometry,
  Mesh,
  MeshBasicMaterial,
  type Object3D,
  SphereGeometry,
  Vector2,
  Vector3,
} from "three";
import { JOINTS, PARENTS, type Pose } from "../../src/motion/skeleton";
import { jointPosition } from "../../src/stage/puppet/standard-figure";

const material = (color: string) => new MeshBasicMaterial({ color });
const SKIN = material("#d9a07e");
const SHIRT = material("#2f5d8c");
const TROUSERS = material("#3c3f46");
const HAIR = material("#2a1b12");
const SHOES = material("#20222a");
const EYE_WHITE = material("#f4f1ec");
const EYE = material("#2b1d14");
const LIPS = material("#a8564c");

/** Joints of the body. */
export class Person {
  readonly group = new Group();
  readonly #bones: Bone[];

  constructor() {
    this.#bones = JOINTS.map((name, joint) => {
      const bone = new Bone();
      bone.name = name;
      const parent = PARENTS[joint];
      bone.position.copy(jointPosition(name));
      if (parent >= 0) bone.position.sub(jointPosition(JOINTS[parent]));
      return bone;
    });
    JOINTS.forEach((_, joint) => {
      if (PARENTS[joint] >= 0) this.#bones[PARENTS[joint]].add(this.#bones[joint]);
    });
    this.group.add(this.#bones[0]);
    this.#addTorso();
    this.#addHead();
    for (const side of ["l", "r"]) {
      this.#addArm(side);
      this.#addLeg(side);
    }
  }

  apply(pose: Pose): void {
    this.#bones[0].position.fromArray(pose.root);
    this.#bones.forEach((bone, joint) => {
      const [w, x, y, z] = pose.rotations.subarray(joint * 4, joint * 4 + 4);
      bone.quaternion.set(x, y, z, w);
    });
    this.group.updateMatrixWorld(true);
  }

  /** Return the world position of a joint, or of a point in its axes. */
  position(name: string, offset = new Vector3()): Vector3 {
    return this.#bone(name).localToWorld(offset.clone());
  }

  #bone(name: string): Bone {
    return this.#bones[JOINTS.indexOf(name)];
  }

  /** Add a shape to a joint; `at` is in world coordinates of the body at rest. */
  #add(joint: string, shape: Object3D, at: Vector3): Object3D {
    shape.position.copy(at).sub(jointPosition(joint));
    this.#bone(joint).add(shape);
    return shape;
  }

  #addEllipsoid(joint: string, at: Vector3, radii: [number, number, number], coat: MeshBasicMaterial): Object3D {
    const mesh = new Mesh(new SphereGeometry(1, 28, 20), coat);
    mesh.scale.set(...radii);
    return this.#add(joint, mesh, at);
  }

  /** Add a limb's segment from `from` to `to`, with its radius at either end. */
  #addSegment(joint: string, from: Vector3, to: Vector3, radii: [number, number], coat: MeshBasicMaterial): void {
    const length = from.distanceTo(to);
    const points: Vector2[] = [];
    for (let i = 0; i <= 24; i++) {
      const share = i / 24;
      // A muscle's belly in the upper third, and round ends.
      const belly = 1 + 0.13 * Math.sin(Math.PI * Math.min(1, share * 1.5));
      points.push(new Vector2((radii[0] + (radii[1] - radii[0]) * share) * belly, share * length));
    }
    const mesh = new Mesh(new LatheGeometry(points, 24), coat);
    mesh.quaternion.setFromUnitVectors(new Vector3(0, 1, 0), to.clone().sub(from).normalize());
    this.#add(joint, mesh, from);
    this.#addEllipsoid(joint, from, [radii[0], radii[0], radii[0]], coat);
    this.#addEllipsoid(joint, to, [radii[1], radii[1], radii[1]], coat);
  }

  #addTorso(): void {
    const profile = [
      [0.001, 0.93],
      [0.15, 0.935],
      [0.158, 0.98],
      [0.142, 1.06],
      [0.138, 1.12],
      [0.15, 1.22],
      [0.166, 1.32],
      [0.17, 1.39],
      [0.15, 1.44],
      [0.1, 1.475],
      [0.055, 1.5],
      [0.001, 1.505],
    ];
    const torso = new Mesh(
      new LatheGeometry(
        profile.map(([radius, height]) => new Vector2(radius, height - 1.2)),
        48,
      ),
      SHIRT,
    );
    torso.scale.set(1.06, 1, 0.68);
    this.#add("vl5", torso, new Vector3(0, 1.2, -0.03));
    for (const sign of [1, -1]) {
      this.#addEllipsoid("vl5", new Vector3(sign * 0.185, 1.43, -0.04), [0.066, 0.058, 0.06], SHIRT);
    }
    this.#addEllipsoid("sacroiliac", new Vector3(0, 0.93, -0.01), [0.168, 0.11, 0.118], TROUSERS);
  }

  #addHead(): void {
    this.#addSegment("vl5", new Vector3(0, 1.47, -0.035), new Vector3(0, 1.58, -0.005), [0.062, 0.056], SKIN);
    const head = new Vector3(0.002, 1.652, 0.018);
    this.#addEllipsoid("skullbase", head, [0.074, 0.1, 0.09], SKIN);
    this.#addEllipsoid("skullbase", new Vector3(0, 1.6, 0.04), [0.056, 0.062, 0.066], SKIN);
    this.#addEllipsoid("skullbase", new Vector3(0, 1.678, 0.0), [0.082, 0.092, 0.094], HAIR);
    this.#addEllipsoid("skullbase", new Vector3(0, 1.655, 0.042), [0.069, 0.075, 0.074], SKIN);
    for (const sign of [1, -1]) {
      this.#addEllipsoid("skullbase", new Vector3(sign * 0.031, 1.662, 0.104), [0.0145, 0.0085, 0.009], EYE_WHITE);
      this.#addEllipsoid("skullbase", new Vector3(sign * 0.031, 1.662, 0.1095), [0.0065, 0.0068, 0.006], EYE);
      const brow = new Mesh(new CapsuleGeometry(0.0035, 0.026, 4, 8), HAIR);
      brow.rotation.z = Math.PI / 2 + sign * 0.12;
      this.#add("skullbase", brow, new Vector3(sign * 0.032, 1.681, 0.107));
      this.#addEllipsoid("skullbase", new Vector3(sign * 0.075, 1.645, 0.01), [0.012, 0.03, 0.02], SKIN);
    }
    this.#addEllipsoid("skullbase", new Vector3(0, 1.643, 0.118), [0.011, 0.02, 0.015], SKIN);
    this.#addEllipsoid("skullbase", new Vector3(0, 1.631, 0.121), [0.014, 0.009, 0.012], SKIN);
    this.#addEllipsoid("skullbase", new Vector3(0, 1.604, 0.104), [0.023, 0.0065, 0.008], LIPS);
  }

  #addArm(side: string): void {
    const sign = side === "l" ? 1 : -1;
    const [shoulder, elbow, wrist] = ["shoulder", "elbow", "wrist"].map((name) => jointPosition(`${side}_${name}`));
    const cuff = shoulder.clone().lerp(elbow, 0.62);
    this.#addSegment(`${side}_shoulder`, shoulder, cuff, [0.06, 0.054], SHIRT);
    this.#addSegment(`${side}_shoulder`, shoulder, elbow, [0.048, 0.041], SKIN);
    this.#addSegment(`${side}_elbow`, elbow, wrist, [0.042, 0.029], SKIN);
    const at = (x: number, y: number, z: number) => wrist.clone().add(new Vector3(sign * x, y, z));
    this.#addEllipsoid(`${side}_wrist`, at(0.001, -0.055, 0.004), [0.02, 0.058, 0.044], SKIN);
    for (let finger = 0; finger < 4; finger++) {
      const z = 0.034 - finger * 0.02;
      const length = [0.062, 0.072, 0.066, 0.05][finger];
      this.#addSegment(`${side}_wrist`, at(0.002, -0.1, z), at(0.003, -0.1 - length, z * 1.1), [0.0105, 0.0075], SKIN);
    }
    this.#addSegment(`${side}_wrist`, at(-0.004, -0.028, 0.036), at(-0.006, -0.09, 0.066), [0.014, 0.009], SKIN);
  }

  #addLeg(side: string): void {
    const [hip, knee, ankle] = ["hip", "knee", "ankle"].map((name) => jointPosition(`${side}_${name}`));
    this.#addSegment(`${side}_hip`, hip, knee, [0.083, 0.058], TROUSERS);
    this.#addSegment(`${side}_knee`, knee, ankle, [0.058, 0.042], TROUSERS);
    const foot = new Vector3(ankle.x, 0.03, 0.03);
    this.#addEllipsoid(`${side}_ankle`, foot, [0.045, 0.038, 0.125], SHOES);
  }
}
