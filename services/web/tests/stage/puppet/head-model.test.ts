import { describe, expect, test } from "vitest";
import type { PuppetHead } from "../../../src/export/glb-face";
import { EXPRESSIONS } from "../../../src/motion/face";
import { createPuppetModel } from "../../../src/stage/puppet/puppet-model";
import { createOtherFigure, createStandardFigure } from "./figures";

const model = createPuppetModel(createStandardFigure());
const { head, rest } = model.separateHead();

/** Return the place on the face (metres from its centre) and the displacement (mm) of all vertices that move. */
function moved({ faceUvs, displacements }: PuppetHead, expression: string) {
  const values = displacements(expression);
  return Array.from({ length: faceUvs.length / 2 }, (_, at) => ({
    x: (faceUvs[at * 2] - 0.5) * 0.2,
    y: (0.5 - faceUvs[at * 2 + 1]) * 0.26,
    by: [...values.subarray(at * 3, at * 3 + 3)].map((value) => value * 1000),
  })).filter(({ by }) => by.some((value) => value !== 0));
}

function area(positions: Float32Array, triangles: Uint32Array): number {
  let sum = 0;
  for (let at = 0; at < triangles.length; at += 3) {
    const [a, b, c] = [0, 1, 2].map((corner) => positions.subarray(triangles[at + corner] * 3));
    const [ux, uy, uz, vx, vy, vz] = [...[0, 1, 2].map((k) => b[k] - a[k]), ...[0, 1, 2].map((k) => c[k] - a[k])];
    sum += Math.hypot(uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx) / 2;
  }
  return sum;
}

describe("the separate head", () => {
  test("and the rest are the whole puppet", () => {
    const { body, face, positions } = model;
    expect(rest.length + head.back.length).toBe(body.length);
    expect(area(head.positions, head.face)).toBeCloseTo(area(positions, face), 8);
    expect(area(head.positions, head.back) + area(positions, rest)).toBeCloseTo(area(positions, body), 8);
  });

  test("has no cracks where its triangles are finer", () => {
    const edges = new Map<string, number>();
    const isBorder = new Set<string>();
    const count = (triangles: Uint32Array, visit: (key: string) => void) => {
      for (let at = 0; at < triangles.length; at++) {
        const next = at % 3 === 2 ? at - 2 : at + 1;
        visit([triangles[at], triangles[next]].sort((a, b) => a - b).join());
      }
    };
    count(head.back, (key) => isBorder.add(key));
    count(head.face, (key) => edges.set(key, (edges.get(key) ?? 0) + 1));
    for (const [key, uses] of edges) if (!isBorder.has(key)) expect(uses).toBe(2);
  });

  test("has normals of unit length and a light colour", () => {
    for (let at = 0; at < head.normals.length; at += 3)
      expect(Math.hypot(...head.normals.subarray(at, at + 3))).toBeCloseTo(1, 5);
    expect(Math.min(...head.colour)).toBeGreaterThan(0.5);
  });
});

describe("expressions", () => {
  test("of an eye close its upper lid", () => {
    const points = moved(head, "eyeBlinkLeft");
    expect(points.length).toBeGreaterThan(20);
    for (const { x, y, by } of points) {
      // Left of the figure is +x.
      expect(x).toBeGreaterThan(0.01);
      expect(x).toBeLessThan(0.05);
      expect(y).toBeGreaterThan(-0.004);
      expect(y).toBeLessThan(0.028);
      expect(by[1]).toBeLessThan(0);
    }
    expect(Math.min(...points.map(({ by }) => by[1]))).toBeLessThan(-9);
  });

  test("open the jaw downwards", () => {
    const points = moved(head, "jawOpen");
    for (const { y, by } of points) {
      expect(y).toBeLessThan(-0.055);
      expect(by[1]).toBeLessThan(0);
    }
    const chin = points.filter(({ x, y }) => Math.abs(x) < 0.01 && y < -0.08);
    expect(Math.min(...chin.map(({ by }) => by[1]))).toBeLessThan(-10);
  });

  test("turn the eyes to the figure's left and up", () => {
    expect(Math.min(...moved(head, "gazeYaw").map(({ by }) => by[0]))).toBeGreaterThan(0);
    expect(Math.min(...moved(head, "gazePitch").map(({ by }) => by[1]))).toBeGreaterThan(0);
    expect(moved(head, "lookRight").every(({ by }) => by[0] < 0)).toBe(true);
  });

  test.each(["eyeBlink", "mouthSmile", "browOuterUp", "browDown", "eyeSquint"])("of %s mirror each other", (name) => {
    const [left, right] = ["Left", "Right"].map((side) => moved(head, `${name}${side}`));
    // The triangles are not mirrored.
    for (const axis of [0, 1]) {
      const ranges = [left, right].map((points) => {
        const values = points.map(({ by }) => by[axis]);
        return [Math.min(...values), Math.max(...values)];
      });
      const mirrored = axis === 0 ? [-ranges[1][1], -ranges[1][0]] : ranges[1];
      for (const end of [0, 1]) expect(Math.abs(mirrored[end] - ranges[0][end])).toBeLessThan(0.4);
    }
  });

  test("move no point by more than 2 cm, and do not fold the face", () => {
    const { positions, face } = head;
    // A gaze of 1 rad is out of reach, and a mouth closes after a jaw has opened.
    for (const name of EXPRESSIONS.filter((expression) => !/^(gaze|mouthClose)/.test(expression))) {
      const displaced = head.displacements(name);
      expect(Math.max(...displaced.map(Math.abs))).toBeLessThan(0.02);
      for (let at = 0; at < displaced.length; at++) displaced[at] += positions[at];
      let least = Infinity;
      for (let at = 0; at < face.length; at += 3) {
        const [a, b, c] = [face[at] * 3, face[at + 1] * 3, face[at + 2] * 3];
        const [ux, uy] = [displaced[b] - displaced[a], displaced[b + 1] - displaced[a + 1]];
        const [vx, vy] = [displaced[c] - displaced[a], displaced[c + 1] - displaced[a + 1]];
        least = Math.min(least, ux * vy - uy * vx);
      }
      // Beside the corners of the eyes, triangles of a millimetre do.
      expect(least).toBeGreaterThan(-2e-6);
    }
  });

  test("are larger on a larger head", () => {
    const other = createPuppetModel(createOtherFigure()).separateHead().head;
    const range = (values: Float32Array, axis: number) => {
      const own = values.filter((_, at) => at % 3 === axis);
      return Math.max(...own) - Math.min(...own);
    };
    const ratio = range(other.positions, 1) / range(head.positions, 1);
    expect(ratio).not.toBeCloseTo(1, 2);
    expect(range(other.displacements("jawOpen"), 1)).toBeCloseTo(ratio * range(head.displacements("jawOpen"), 1), 4);
  });
});
