import { Object3D, Quaternion, Vector3 } from "three";
import { describe, expect, test } from "vitest";
import type { StagedPose } from "../../../src/motion/extension";
import { restPose } from "../../../src/motion/skeleton";
import { type FootedLeg, PlantedFeet } from "../../../src/stage/puppet/planted-feet";
import { setPlantedFeet } from "../../../src/stage/puppet/puppet";
import { jointPosition } from "../../../src/stage/puppet/standard-figure";
import { createStandingPuppet } from "./figures";

const FRAME_US = 16_667;
const HIP_HEIGHT = 0.86;
const THIGH = 0.42;
const SHANK = 0.4;
/** Bend of the knees in the pose, radians. */
const BEND = 0.5;

const worldOf = (node: Object3D) => new Vector3().setFromMatrixPosition(node.matrixWorld);
const rotationOf = (node: Object3D) => node.getWorldQuaternion(new Quaternion());

/** Two legs below a base, in nodes with axes and a scale of their own. */
class Figure {
  readonly base = new Object3D();
  readonly legs: readonly FootedLeg[];
  readonly feet: PlantedFeet;
  clock = 1e15;

  constructor(scale = 1) {
    const stand = new Object3D();
    stand.scale.setScalar(scale);
    stand.add(this.base);
    this.legs = [1, -1].map((side) => {
      const [hip, knee, ankle] = [new Object3D(), new Object3D(), new Object3D()];
      const inner = new Object3D();
      inner.quaternion.setFromAxisAngle(new Vector3(1, 2, 3).normalize(), 0.7);
      const local = (at: Vector3) => at.applyQuaternion(inner.quaternion.clone().invert());
      this.base.add(inner);
      inner.add(hip);
      hip.add(knee);
      knee.add(ankle);
      hip.position.copy(local(new Vector3(0.1 * side, 0, 0)));
      hip.userData = { rest: inner.quaternion.clone().invert() };
      knee.position.set(0, -THIGH, 0);
      ankle.position.set(0, -SHANK, 0);
      return { hip, knee, ankle, hinge: new Vector3(1, 0, 0), ball: new Vector3(0, -0.06, 0.12) };
    });
    this.feet = new PlantedFeet(this.base, this.legs);
  }

  /** Show a pose with the base moved by `moved`, and the knees bent. */
  show(moved: Vector3, planted: number | null, controlled = 0, bend = BEND): void {
    this.clock += FRAME_US;
    this.base.position.set(0, HIP_HEIGHT, 0).add(moved);
    for (const { hip, knee, ankle } of this.legs) {
      const turn = (angle: number) => new Quaternion().setFromAxisAngle(new Vector3(1, 0, 0), angle);
      hip.quaternion.copy(hip.userData["rest"] as Quaternion).multiply(turn(-bend / 2));
      knee.quaternion.copy(turn(bend));
      ankle.quaternion.copy(turn(-bend / 2));
    }
    (this.base.parent as Object3D).updateMatrixWorld(true);
    this.feet.apply(planted === null ? null : { planted, controlled, clock: this.clock });
  }

  ball(side = 0): Vector3 {
    const { ball, ankle } = this.legs[side];
    return ball.clone().applyMatrix4(ankle.matrixWorld);
  }
}

const x = (metres: number) => new Vector3(metres, 0, 0);

describe.each([1, 0.01, 40])("figure at a scale of %d", (scale) => {
  test("planted feet stay while the base moves, and keep their direction", () => {
    const figure = new Figure(scale);
    figure.show(x(0), 3);
    const [place, direction] = [figure.ball(), rotationOf(figure.legs[0].ankle)];
    for (let moved = 0; moved < 0.12; moved += 0.004) {
      figure.show(new Vector3(moved, 0, moved / 2), 3);
      expect(figure.ball().distanceTo(place) / scale).toBeLessThan(1e-6);
      expect(rotationOf(figure.legs[0].ankle).angleTo(direction)).toBeLessThan(1e-6);
    }
    for (const { hip, knee, ankle } of figure.legs) {
      expect(worldOf(hip).distanceTo(worldOf(knee)) / scale).toBeCloseTo(THIGH, 9);
      expect(worldOf(knee).distanceTo(worldOf(ankle)) / scale).toBeCloseTo(SHANK, 9);
    }
  });

  test("the correction of a lifted foot fades in 0.2 s without a jump", () => {
    const figure = new Figure(scale);
    for (let moved = 0; moved <= 0.08; moved += 0.004) figure.show(x(moved), 3);
    const held = figure.feet.offsets[0].length();
    let before = held;
    for (let frame = 0; frame < 13; frame++) {
      figure.show(x(0.08), 2);
      const offset = figure.feet.offsets[0].length();
      expect(offset).toBeLessThanOrEqual(before);
      expect(before - offset).toBeLessThan(0.2 * held);
      before = offset;
    }
    expect(held / scale).toBeCloseTo(0.08, 2);
    expect(before).toBe(0);
  });
});

test("a pose without contacts, and one whose feet are where they were put, stay as they are", () => {
  const [figure, plain] = [new Figure(), new Figure()];
  for (const [moved, planted] of [
    [0, null],
    [0.2, 0],
    [0.4, 3],
    [0.4, 3],
  ] as const) {
    figure.show(x(moved), planted);
    plain.show(x(moved), null);
    expect(figure.base.position).toEqual(plain.base.position);
    figure.legs.forEach(({ hip, knee, ankle }, side) => {
      for (const [node, same] of [
        [hip, plain.legs[side].hip],
        [knee, plain.legs[side].knee],
        [ankle, plain.legs[side].ankle],
      ])
        expect(node.quaternion.toArray()).toEqual(same.quaternion.toArray());
    });
  }
});

test("the figure is lowered if a leg is too short, and the other foot stays", () => {
  const figure = new Figure();
  figure.show(x(0), 1, 0, 0.1);
  const [place, other] = [figure.ball(0), figure.ball(1)];
  for (let step = 0; step <= 30; step++) figure.show(x(step / 100), 1, 0, 0.1);
  expect(figure.ball(0).distanceTo(place)).toBeLessThan(1e-6);
  expect(figure.base.position.y).toBeLessThan(HIP_HEIGHT - 0.02);
  expect(figure.ball(1).distanceTo(other.add(x(0.3)))).toBeLessThan(1e-6);
});

test("a foot out of reach slides as little as it has to", () => {
  const figure = new Figure();
  figure.show(x(0), 1);
  const place = figure.ball();
  for (let moved = 0; moved <= 0.9; moved += 0.02) figure.show(x(moved), 1);
  const slide = figure.ball().distanceTo(place);
  expect(slide).toBeGreaterThan(0.3);
  expect(slide).toBeLessThan(0.7);
  expect(figure.base.position.y).toBeGreaterThan(HIP_HEIGHT - 0.11);
});

test("a controlled leg is not touched, even if the figure is lowered", () => {
  const figure = new Figure();
  figure.show(x(0), 1, 2);
  const before = figure.legs[1].knee.quaternion.clone();
  for (let moved = 0; moved <= 0.4; moved += 0.01) figure.show(x(moved), 1, 2);
  expect(figure.base.position.y).toBeLessThan(HIP_HEIGHT);
  expect(figure.legs[1].knee.quaternion.toArray()).toEqual(before.toArray());
  expect(figure.legs[1].ankle.quaternion.w).toBe(Math.cos(BEND / 4));
});

test("a seek puts the feet down where they are", () => {
  const figure = new Figure();
  for (let moved = 0; moved <= 0.1; moved += 0.01) figure.show(x(moved), 3);
  figure.show(x(1), 3);
  expect(figure.feet.offsets.map((offset) => offset.length())).toEqual([0, 0]);
  const place = figure.ball();
  figure.show(x(1.02), 3);
  expect(figure.ball().distanceTo(place)).toBeLessThan(1e-6);
});

test("a foot that is planted at the end of a loop and at its start stays", () => {
  const figure = new Figure();
  figure.show(x(0), 3);
  const place = figure.ball();
  for (let frame = 1; frame < 60; frame++) {
    figure.show(x(0.0005 * (frame % 20)), 3);
    expect(figure.ball().distanceTo(place)).toBeLessThan(1e-6);
  }
});

test("a pause leaves the correction as it is", () => {
  const figure = new Figure();
  for (let moved = 0; moved <= 0.1; moved += 0.01) figure.show(x(moved), 3);
  const place = figure.ball();
  for (let frame = 0; frame < 60; frame++) figure.show(x(0.1), 3);
  expect(figure.ball().distanceTo(place)).toBeLessThan(1e-9);
});

test("contacts that are not known any more end the correction", () => {
  const figure = new Figure();
  for (let moved = 0; moved <= 0.1; moved += 0.01) figure.show(x(moved), 3);
  figure.show(x(0.1), null);
  expect(figure.ball().x).toBeCloseTo(0.2, 9);
});

test("a foot that rolls keeps the height of the pose, and one that the base lifts does not", () => {
  const figure = new Figure();
  figure.show(new Vector3(), 3);
  const height = figure.ball().y;
  for (const lift of [0.01, 0.02, 0.03]) {
    figure.show(new Vector3(0, lift, 0), 3);
    expect(figure.ball().y).toBeCloseTo(height + lift, 9);
  }
  for (let lift = 0.03; lift < 0.08; lift += 0.01) figure.show(new Vector3(0, lift, 0), 3);
  expect(figure.ball().y - height).toBeLessThan(0.034);
});

test("a straight knee bends to the front, and never jumps to the side or back", () => {
  for (const bend of [-0.06, -0.01, 0, 0.01]) {
    const figure = new Figure();
    figure.show(x(0), 3, 0, bend);
    let before = figure.legs.map(({ knee }) => worldOf(knee));
    for (let step = 1; step <= 100; step++) {
      const moved = new Vector3(0, -step / 2000, step / 4000);
      figure.show(moved, 3, 0, bend + 0.002 * (step % 2));
      const knees = figure.legs.map(({ knee }) => worldOf(knee));
      knees.forEach((knee, side) => {
        expect(knee.distanceTo(before[side])).toBeLessThan(0.03);
      });
      before = knees;
    }
    figure.legs.forEach(({ hip, ankle }, side) => {
      const middle = worldOf(hip).lerp(worldOf(ankle), 0.5);
      expect(before[side].z - middle.z).toBeGreaterThan(0.08);
      expect(Math.abs(before[side].x - middle.x)).toBeLessThan(0.01);
    });
  }
});

test("the puppet keeps a planted foot in place, and its other joints in their pose", () => {
  setPlantedFeet(PlantedFeet);
  const puppet = createStandingPuppet();
  const pose: StagedPose = restPose();
  const step = (frame: number, planted: number) => {
    jointPosition("humanoid_root")
      .add(new Vector3(0.003 * frame, 0, 0.002 * frame))
      .toArray(pose.root);
    pose.contacts = { planted, controlled: 0, clock: 1e15 + frame * FRAME_US };
    puppet.apply(pose, 0);
    return ["l_midtarsal", "r_midtarsal", "l_wrist"].map((name) =>
      new Vector3().setFromMatrixPosition(puppet.joint(name)),
    );
  };
  const first = step(0, 1);
  let last = first;
  for (let frame = 1; frame <= 30; frame++) last = step(frame, 1);
  expect(last[0].distanceTo(first[0])).toBeLessThan(1e-6);
  expect(last[1].distanceTo(first[1])).toBeCloseTo(Math.hypot(0.09, 0.06), 6);
  expect(last[2].x - first[2].x).toBeCloseTo(0.09, 9);
});

test("whatever the base and the contacts do, nothing jumps", () => {
  let state = 7;
  const random = () => (state = (state * 48271) % 2147483647) / 2147483647;
  for (let run = 0; run < 40; run++) {
    const figure = new Figure();
    const waves = Array.from({ length: 3 }, () => [0.15 * random(), 1 + 3 * random(), 6 * random()]);
    let planted = 0;
    let before: Vector3[] | null = null;
    for (let frame = 0; frame < 240; frame++) {
      if (random() < 0.05) planted = Math.floor(4 * random());
      const moved = new Vector3(...waves.map(([size, rate, phase]) => size * Math.sin((rate * frame) / 60 + phase)));
      moved.y *= 0.2;
      figure.show(moved, planted);
      const after = figure.legs.flatMap(({ knee, ankle }) => [worldOf(knee), worldOf(ankle)]);
      after.forEach((place, n) => {
        expect(Number.isFinite(place.x + place.y + place.z)).toBe(true);
        if (before) expect(place.distanceTo(before[n])).toBeLessThan(0.06);
      });
      before = after;
    }
  }
});
