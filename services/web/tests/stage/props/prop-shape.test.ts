import { Vector3 } from "three";
import { describe, expect, test } from "vitest";
import type { PropShape } from "../../../src/motion/prop-model";
import {
  BALL_RADIUS_M,
  createPropTransform,
  laidTransform,
  PROP_FORMS,
  PROP_KINDS,
  type PropKind,
  UMBRELLA,
} from "../../../src/motion/props";
import { rotate } from "../../../src/motion/rotation";
import { createPropShape } from "../../../src/stage/props/prop-shape";

const MAX_TRIANGLES = 1_500;
/** How far a laid prop may be in the floor or above it, in metres. */
const [MAX_SINK_M, MAX_GAP_M] = [0.004, 0.008];

const corners = ({ positions }: PropShape) =>
  Array.from({ length: positions.length / 3 }, (_, at) => new Vector3().fromArray(positions, at * 3));

describe.each(PROP_KINDS)("the %s", (kind: PropKind) => {
  const shape = createPropShape(kind);

  test("has few triangles, all of them with an area and on their front side", () => {
    expect(shape.indices.length / 3).toBeGreaterThan(100);
    expect(shape.indices.length / 3).toBeLessThanOrEqual(MAX_TRIANGLES);
    const places = corners(shape);
    let facing = 0;
    for (let at = 0; at < shape.indices.length; at += 3) {
      const [a, b, c] = shape.indices.slice(at, at + 3).map((index) => places[index]);
      const face = b.clone().sub(a).cross(c.clone().sub(a));
      expect(face.length()).toBeGreaterThan(0);
      const normal = new Vector3().fromArray(shape.normals, shape.indices[at] * 3);
      expect(normal.length()).toBeCloseTo(1, 6);
      if (normal.dot(face) > 0) facing++;
    }
    // Poles of small solids have a normal of their neighbours.
    expect(facing / (shape.indices.length / 3)).toBeGreaterThan(0.98);
  });

  test("has values for every vertex", () => {
    const count = shape.positions.length;
    for (const values of [shape.normals, shape.colours, shape.finishes]) expect(values.length).toBe(count);
    for (const values of Object.values(shape)) expect((values as number[]).every(Number.isFinite)).toBe(true);
    expect(Math.max(...shape.indices)).toBeLessThan(count / 3);
    expect(shape.colours.every((value) => value >= 0 && value <= 1)).toBe(true);
  });

  test("rests on the floor", () => {
    const { position, rotation } = laidTransform(PROP_FORMS[kind], [0, 0, 0.3], 0, createPropTransform());
    const out = new Float64Array(3);
    const heights = corners(shape).map((corner) => {
      rotate(out, 0, rotation, 0, Float64Array.from(corner.toArray()), 0);
      return out[1] + position[1];
    });
    expect(Math.min(...heights)).toBeGreaterThan(-MAX_SINK_M);
    expect(Math.min(...heights)).toBeLessThan(MAX_GAP_M);
  });
});

test("the umbrella ends at its rim and at its handle", () => {
  const places = corners(createPropShape("umbrella"));
  const radius = Math.max(...places.map(({ x, z }) => Math.hypot(x, z)));
  expect(radius).toBeCloseTo(UMBRELLA.rimRadius, 6);
  expect(Math.min(...places.map(({ y }) => y))).toBeCloseTo(-UMBRELLA.handleLength, 6);
});

test("the ball is round about its grip", () => {
  for (const place of corners(createPropShape("ball"))) expect(place.length()).toBeCloseTo(BALL_RADIUS_M, 6);
});

test("fan and branch extend from the grip to the far end", () => {
  for (const kind of ["fan", "branch"] as const) {
    const heights = corners(createPropShape(kind)).map(({ y }) => y);
    expect(Math.max(...heights)).toBeGreaterThan(0.25);
    expect(Math.min(...heights)).toBeGreaterThan(-0.12);
  }
});
