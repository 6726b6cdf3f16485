/**
 * Head of the puppet as a mesh of its own, for files: its vertices move with the expressions of a face, as the paint
 * does on the stage (`face-paint.ts`).
 */
import type { PuppetHead } from "../../../export/glb-face";
import { expressionIndex } from "../../../motion/face";
import { FACE_WINDOW_M } from "../geometry-builder";
import { smoothStep } from "../surface";
import { MOVEMENTS, parseEffects } from "./expression";

/** Vertices of the puppet, and triangles of its head with and without the face texture. */
interface HeadSource {
  readonly positions: Float32Array;
  readonly normals: Float32Array;
  readonly colours: Float32Array;
  readonly faceUvs: Float32Array;
  readonly face: readonly number[];
  readonly back: readonly number[];
}

/** Parts of the face that need finer triangles: least and largest |x|, least and largest y, in metres. */
const FINE_PARTS = [
  [0.008, 0.05, -0.014, 0.02],
  [0, 0.03, -0.074, -0.048],
] as const;
/** Largest extent of their triangles along x and y, in metres. */
const MAX_EDGE_M = 0.004;
/** Depth from the middle of the head to the chin, in metres. */
const CHIN_DEPTH_M = 0.07;

/** Return the head, its triangles refined at eyes and mouth. */
export function createHeadModel(source: HeadSource): PuppetHead {
  const vertices = new Map<number, number>();
  const head = { positions: [] as number[], normals: [] as number[], faceUvs: [] as number[] };
  const parts = [
    [head.positions, source.positions, 3],
    [head.normals, source.normals, 3],
    [head.faceUvs, source.faceUvs, 2],
  ] as const;
  const keep = (vertex: number) => {
    const known = vertices.get(vertex);
    if (known !== undefined) return known;
    for (const [to, from, size] of parts) to.push(...from.subarray(vertex * size, (vertex + 1) * size));
    vertices.set(vertex, vertices.size);
    return vertices.size - 1;
  };
  const face = source.face.map(keep);
  const back = source.back.map(keep);
  const refined = refine(
    face,
    (a, b) => isTooLong(facePoint(head.faceUvs, a), facePoint(head.faceUvs, b)),
    (a, b) => {
      for (const [to, , size] of parts) {
        const middle = Array.from({ length: size }, (_, axis) => (to[a * size + axis] + to[b * size + axis]) / 2);
        const length = to === head.normals ? Math.hypot(...middle) : 1;
        to.push(...middle.map((value) => value / length));
      }
      return head.faceUvs.length / 2 - 1;
    },
  );
  const [first] = source.face;
  const points = facePoints(head);
  const effects = parseEffects();
  return {
    positions: Float32Array.from(head.positions),
    normals: Float32Array.from(head.normals),
    faceUvs: Float32Array.from(head.faceUvs),
    colour: [...source.colours.subarray(first * 3, first * 3 + 3)],
    face: Uint32Array.from(refined),
    back: Uint32Array.from(back),
    displacements(expression) {
      const out = new Float32Array(head.positions.length);
      const index = expressionIndex(expression);
      for (const [, movement, factor] of effects.filter((effect) => effect[0] === index)) {
        const field = fieldOf(MOVEMENTS[movement]);
        points.places.forEach((place, vertex) =>
          field(place, factor).forEach((moved, axis) => (out[vertex * 3 + axis] += factor * points.scale * moved)),
        );
      }
      return out;
    },
  };
}

/** Return x to the figure's left and y up from the centre of the face, in metres on the standard figure. */
function facePoint(uvs: readonly number[], vertex: number): [x: number, y: number] {
  return [(uvs[vertex * 2] - 0.5) * FACE_WINDOW_M[0], (0.5 - uvs[vertex * 2 + 1]) * FACE_WINDOW_M[1]];
}

function isTooLong([ax, ay]: readonly [number, number], [bx, by]: readonly [number, number]): boolean {
  if (Math.max(Math.abs(ax - bx), Math.abs(ay - by)) <= MAX_EDGE_M) return false;
  const [x, y] = [Math.abs(ax + bx) / 2, (ay + by) / 2];
  return FINE_PARTS.some(([left, right, low, high]) => x > left && x < right && y > low && y < high);
}

/** Split the edges that are too long, in all their triangles, until none is left. */
function refine(
  triangles: readonly number[],
  isLong: (a: number, b: number) => boolean,
  addMiddle: (a: number, b: number) => number,
): number[] {
  const middles = new Map<string, number>();
  const middleOf = (a: number, b: number) => {
    const key = a < b ? `${a} ${b}` : `${b} ${a}`;
    const middle = middles.get(key) ?? addMiddle(a, b);
    middles.set(key, middle);
    return middle;
  };
  const done: number[] = [],
    divided: number[] = [];
  for (let at = 0; at < triangles.length; at += 3) {
    const corners = triangles.slice(at, at + 3);
    const split = corners.map((corner, side) => {
      const next = corners[(side + 1) % 3];
      return isLong(corner, next) ? middleOf(corner, next) : -1;
    });
    const first = split.findIndex((middle) => middle >= 0);
    if (first < 0) {
      done.push(...corners);
    } else if (split.every((middle) => middle >= 0)) {
      corners.forEach((corner, side) => divided.push(corner, split[side], split[(side + 2) % 3]));
      divided.push(...split);
    } else {
      // A fan from one of the middles.
      const outline = [1, 2, 3].flatMap((step) => {
        const side = (first + step) % 3;
        return split[side] < 0 || side === first ? [corners[side]] : [corners[side], split[side]];
      });
      for (let corner = 1; corner < outline.length; corner++)
        divided.push(split[first], outline[corner - 1], outline[corner]);
    }
  }
  return divided.length > 0 ? [...done, ...refine(divided, isLong, addMiddle)] : done;
}

type Point = readonly [x: number, y: number, z: number];
/** Displacement of a point of the face at the factor 1 or -1 of a movement, in metres. */
type Field = (at: Point, factor: number) => Point;

const clamp = (value: number) => Math.min(Math.max(value, 0), 1);

/** Lines of the lids at a distance from the middle of the face, and their curvature, 0 at the corners of the eye. */
function lidLines(x: number) {
  const t = clamp((x - 0.012) / (0.032 + 0.135 * (x - 0.012)));
  const upper = 0.0012 + t * (0.034 - 0.0282 * t);
  // Drawn, the lines cross beside the corners.
  const lower = Math.min(0.0033 + t * (0.0307 * t - 0.026), upper - 0.001);
  return { upper, lower, bow: 4 * t * (1 - t) };
}

/** Share of a point on a side of the mouth or the brows, 0..1, which have no gap in the middle. */
const sideShare = (side: number, x: number) => smoothStep(-0.006, 0.006, side * x);
const lipShare = ([x, y]: Point) =>
  smoothStep(0.045, 0.02, Math.abs(x)) * smoothStep(0.024, 0.012, Math.abs(y + 0.059));
const browShare = ([x, y]: Point, side: number) =>
  0.0055 * sideShare(side, x) * smoothStep(0.014, 0.026, y) * smoothStep(0.085, 0.055, y);
const browEnd = (x: number) => clamp((Math.abs(x) - 0.012) / 0.042);

function moveUpperLid([x, y]: Point, side: number, factor: number): Point {
  const { upper, lower, bow } = lidLines(side * x);
  const share = y < upper ? clamp((y - lower) / (upper - lower)) : clamp((0.027 - y) / (0.027 - upper));
  return [0, (factor < 0 ? -0.0024 : -0.0126) * bow * share, 0];
}

function moveLowerLid([x, y]: Point, side: number): Point {
  const { upper, lower, bow } = lidLines(side * x);
  const share = y > lower ? clamp((upper - y) / (upper - lower)) : clamp((y + 0.025) / (lower + 0.025));
  return [0, 0.0035 * bow * share, 0];
}

/** Return how far a point moves with the iris, 0..1. */
function irisShare([x, y]: Point, side: number): number {
  const { upper, lower } = lidLines(side * x);
  const inside = smoothStep(lower - 0.007, lower + 0.002, y) * smoothStep(upper + 0.007, upper - 0.002, y);
  return inside * smoothStep(0.0165, 0.005, Math.abs(side * x - 0.0283));
}

/** Movements of one side, by their names without it. */
const SIDED_FIELDS: Readonly<Record<string, (at: Point, side: number, factor: number) => Point>> = {
  Lid: moveUpperLid,
  Lower: moveLowerLid,
  IrisX: (at, side) => [0.0068 * irisShare(at, side), 0, 0],
  IrisY: (at, side) => [0, 0.003 * irisShare(at, side), 0],
  BrowIn: (at, side) => [0, browShare(at, side) * (1 - browEnd(at[0])), 0],
  BrowOut: (at, side) => [0, browShare(at, side) * browEnd(at[0]), 0],
  Corner: (at, side) => [
    0,
    0.0042 * Math.min(Math.abs(at[0]) / 0.0165, 1.3) ** 2 * lipShare(at) * sideShare(side, at[0]),
    0,
  ],
};
const FIELDS: Readonly<Record<string, Field>> = {
  jaw: ([x, y, z]) => {
    // Sharp at the lips, soft at the cheeks.
    const low = -0.064 - 0.02 * smoothStep(0.016, 0.03, Math.abs(x));
    const share = smoothStep(-0.057, low, y) * clamp(z / CHIN_DEPTH_M);
    return [0, -0.014 * share, -0.005 * share];
  },
  mouth: (at, factor) =>
    factor < 0
      ? [0.36 * at[0] * lipShare(at), -0.3 * (at[1] + 0.059) * lipShare(at), 0]
      : [0.28 * at[0] * lipShare(at), 0, 0],
};

function fieldOf(movement: string): Field {
  const [, side, name] = /^(left|right)(.*)$/.exec(movement) ?? [];
  return side ? (at, factor) => SIDED_FIELDS[name](at, side === "left" ? 1 : -1, factor) : FIELDS[movement];
}

/**
 * Return the vertices on the standard figure, relative to the centre of the face and the middle of the head, and the
 * size of this head.
 */
function facePoints({ positions, faceUvs }: Readonly<Record<"positions" | "faceUvs", readonly number[]>>): {
  places: Point[];
  scale: number;
} {
  const heights = range(positions, 3, 1),
    drawn = range(faceUvs, 2, 1),
    depths = range(positions, 3, 2);
  const scale = (heights[1] - heights[0]) / ((drawn[1] - drawn[0]) * FACE_WINDOW_M[1]);
  const middle = (depths[0] + depths[1]) / 2;
  const places = Array.from({ length: positions.length / 3 }, (_, vertex): Point => {
    const [x, y] = facePoint(faceUvs, vertex);
    return [x, y, (positions[vertex * 3 + 2] - middle) / scale];
  });
  return { places, scale };
}

/** Return the least and the largest value of a component. */
function range(values: readonly number[], size: number, component: number): [low: number, high: number] {
  let [low, high] = [Infinity, -Infinity];
  for (let at = component; at < values.length; at += size)
    [low, high] = [Math.min(low, values[at]), Math.max(high, values[at])];
  return [low, high];
}
