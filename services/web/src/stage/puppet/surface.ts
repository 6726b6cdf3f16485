/** Parametric surfaces, from which all parts of the puppet are made. Metres. */
import { CatmullRomCurve3, Quaternion, Vector3 } from "three";

/** How finely a surface is sampled: coarsely, with about half of the triangles, for software rendering. */
export type Detail = "full" | "coarse";

/** Vertices and triangles of a part: three numbers per vertex, two for `uvs`. */
export interface SurfaceMesh {
  positions: number[];
  normals: number[];
  uvs: number[];
  indices: number[];
}

/** Return a new mesh of a surface. */
export type Surface = (detail: Detail) => SurfaceMesh;

export type SurfaceFunction = (u: number, v: number) => Vector3;
export type UvFunction = (u: number, v: number, at: Vector3) => readonly [number, number];

const DOWN = new Vector3(0, -1, 0);
const DERIVATIVE_STEP = 1e-3;
/**
 * Coarse meshes have half of the columns. Grids with fewer cells across keep them all, and have half of the rows
 * instead if they have enough: they are thin, like fingers.
 */
const MIN_COARSE_COLUMNS = 12;
const MIN_COARSE_ROWS = 6;

/** Return a smooth step from 0 at `from` to 1 at `to`, which may be smaller than `from`. */
export function smoothStep(from: number, to: number, x: number): number {
  const t = Math.min(1, Math.max(0, (x - from) / (to - from)));
  return t * t * (3 - 2 * t);
}

/** Return x raised to a power with its sign kept: the coordinate of a superellipse. */
export function signedPower(x: number, power: number): number {
  return Math.sign(x) * Math.abs(x) ** power;
}

/**
 * Return a cubic Hermite curve through rows `[t, ...values]` with rising t, clamped to its ends. Each call returns the
 * same array: copy the values at once.
 */
export function curve(keys: readonly (readonly number[])[]): (t: number) => readonly number[] {
  const last = keys.length - 1;
  const out: number[] = Array.from({ length: keys[0].length - 1 }, () => 0);
  return (at) => {
    const t = Math.min(keys[last][0], Math.max(keys[0][0], at));
    let i = 0;
    while (i < last - 1 && t > keys[i + 1][0]) i++;
    const [before, start, end, after] = [keys[Math.max(i - 1, 0)], keys[i], keys[i + 1], keys[Math.min(i + 2, last)]];
    const span = end[0] - start[0];
    const s = (t - start[0]) / span;
    const rise = s * s * (3 - 2 * s);
    const leave = s * (s - 1) * (s - 1) * span;
    const arrive = s * s * (s - 1) * span;
    for (let k = 1; k <= out.length; k++) {
      const step = end[k] - start[k];
      const m0 = i === 0 ? step / span : (end[k] - before[k]) / (end[0] - before[0]);
      const m1 = i === last - 1 ? step / span : (after[k] - start[k]) / (after[0] - start[0]);
      out[k - 1] = start[k] + rise * step + leave * m0 + arrive * m1;
    }
    return out;
  };
}

/**
 * Return a grid of `columns` x `rows` cells over `at(u, v)`, u and v in 0..1. Normals are finite differences of the
 * surface, so that a seam (u = 0 and u = 1) shades evenly; `at` must accept u slightly outside 0..1.
 */
export function grid(at: SurfaceFunction, columns: number, rows: number, uv?: UvFunction): Surface {
  return (detail) => {
    const isCoarse = detail === "coarse";
    const isThin = columns < MIN_COARSE_COLUMNS;
    const across = sample(columns, isCoarse && !isThin ? 2 : 1);
    const along = sample(rows, isCoarse && isThin && rows >= MIN_COARSE_ROWS ? 2 : 1);
    const mesh: SurfaceMesh = { positions: [], normals: [], uvs: [], indices: [] };
    for (const v of along)
      for (const u of across) {
        const point = at(u, v);
        let normal = surfaceNormal(at, u, v);
        // At a pole the tangent vanishes: take the normal a little further in.
        if (normal.lengthSq() < 1e-16) normal = surfaceNormal(at, u, v < 0.5 ? v + 0.02 : v - 0.02);
        normal.normalize();
        mesh.positions.push(point.x, point.y, point.z);
        mesh.normals.push(normal.x, normal.y, normal.z);
        mesh.uvs.push(...(uv ? uv(u, v, point) : [u, v]));
      }
    mesh.indices = triangulate(across.length, along.length);
    return mesh;
  };
}

/** Return the positions (0..1) of every `step`th line of a grid of `cells`, and of the last. */
function sample(cells: number, step: number): number[] {
  return [...Array.from({ length: Math.ceil(cells / step) }, (_, at) => (at * step) / cells), 1];
}

/** Return the triangles of a grid of `columns` x `rows` vertices. */
function triangulate(columns: number, rows: number): number[] {
  const indices: number[] = [];
  for (let j = 1; j < rows; j++)
    for (let i = 1; i < columns; i++) {
      const d = j * columns + i;
      const [a, b, c] = [d - columns - 1, d - columns, d - 1];
      indices.push(a, b, c, b, d, c);
    }
  return indices;
}

function surfaceNormal(at: SurfaceFunction, u: number, v: number): Vector3 {
  const across = at(u + DERIVATIVE_STEP, v).sub(at(u - DERIVATIVE_STEP, v));
  const along = at(u, Math.min(v + DERIVATIVE_STEP, 1)).sub(at(u, Math.max(v - DERIVATIVE_STEP, 0)));
  return across.cross(along);
}

export interface LatheOptions {
  /** Scale of the radius in width and in depth. */
  widthScale?: number;
  depthScale?: number;
  columns?: number;
  /** Number of rows at equal distances, or `profile`: one at each row of the profile. */
  rows?: number | "profile";
  uv?: UvFunction;
}

/**
 * Return a solid of revolution from `from` to `to`; `profile` rows are (position, radius) in fractions of the length.
 */
export function lathe(
  from: Vector3,
  to: Vector3,
  profile: readonly (readonly number[])[],
  options: LatheOptions = {},
): Surface {
  const { widthScale: wide = 1, depthScale: deep = 1, columns = 14, rows = 16, uv } = options;
  const axis = to.clone().sub(from);
  const length = axis.length();
  const turn = new Quaternion().setFromUnitVectors(DOWN, axis.divideScalar(length));
  const radius = curve(profile);
  const places = rows === "profile" ? profile.map(([t]) => t) : [profile[0][0], profile[profile.length - 1][0]];
  const spans = places.length - 1;
  return grid(
    (u, v) => {
      const span = Math.min(Math.floor(v * spans), spans - 1);
      const t = places[span] + (places[span + 1] - places[span]) * (v * spans - span);
      const r = radius(t)[0] * length;
      const angle = u * 2 * Math.PI;
      return new Vector3(Math.sin(angle) * r * wide, -t * length, Math.cos(angle) * r * deep)
        .applyQuaternion(turn)
        .add(from);
    },
    columns,
    rows === "profile" ? spans : rows,
    uv,
  );
}

/** Return a sphere, or an ellipsoid with `stretch`. */
export function ball(
  centre: Vector3,
  radius: number,
  stretch: readonly [number, number, number] = [1, 1, 1],
  columns = 12,
): Surface {
  return grid(
    (u, v) => {
      const angle = u * 2 * Math.PI;
      const fall = v * Math.PI;
      return new Vector3(
        Math.sin(angle) * Math.sin(fall) * stretch[0],
        Math.cos(fall) * stretch[1],
        Math.cos(angle) * Math.sin(fall) * stretch[2],
      )
        .multiplyScalar(radius)
        .add(centre);
    },
    columns,
    Math.round(columns * 0.62),
  );
}

/** Return a torus around `axis`: rings of the joints, piping of the cuffs. */
export function ring(centre: Vector3, axis: Vector3, radius: number, tube: number, wide = 1, deep = 1): Surface {
  const turn = new Quaternion().setFromUnitVectors(DOWN, axis.clone().normalize());
  return grid(
    (u, v) => {
      const [a, b] = [u * 2 * Math.PI, v * 2 * Math.PI];
      const r = radius + tube * Math.cos(b);
      return new Vector3(Math.sin(a) * r * wide, tube * Math.sin(b), Math.cos(a) * r * deep)
        .applyQuaternion(turn)
        .add(centre);
    },
    20,
    4,
  );
}

/** Return a rod with round ends: fingers, ends of a cord. */
export function capsule(from: Vector3, to: Vector3, radius: number, endRadius = radius): Surface {
  const length = from.distanceTo(to);
  const [a, b] = [radius / length, endRadius / length];
  const profile = [
    [-a, 1e-4],
    [-0.8 * a, 0.6 * a],
    [-0.35 * a, 0.93 * a],
    [0, a],
    [1, b],
    [1 + 0.35 * b, 0.93 * b],
    [1 + 0.8 * b, 0.6 * b],
    [1 + b, 1e-4],
  ];
  return lathe(from, to, profile, { columns: 6, rows: 6 });
}

/**
 * Return superellipse sections stacked in y: rows are (y, centre z, half width, half depth, power). `lift` enlarges
 * them.
 */
export function loft(sections: readonly (readonly number[])[], columns: number, rows: number, lift = 0): Surface {
  const section = curve(sections);
  const [low, high] = [sections[0][0], sections[sections.length - 1][0]];
  return grid(
    (u, v) => {
      const y = low + (high - low) * v;
      const [cz, wide, deep, power] = section(y);
      const angle = u * 2 * Math.PI;
      return new Vector3(
        signedPower(Math.sin(angle), 2 / power) * (wide + lift),
        y,
        cz + signedPower(Math.cos(angle), 2 / power) * (deep + lift),
      );
    },
    columns,
    rows,
    (u, _v, at) => [u * 2 * Math.PI * 0.16, at.y],
  );
}

/** Return a tube along a smooth line; `radius` rows are (position, radius), `stretch` scales it in x, y and z. */
export function tube(
  line: readonly Vector3[],
  radius: readonly (readonly number[])[],
  stretch: readonly [number, number, number],
): Surface {
  const path = new CatmullRomCurve3([...line]);
  const thick = curve(radius);
  const across = new Vector3(1, 0, 0);
  return grid(
    (u, v) => {
      const t = Math.min(1, Math.max(0, v));
      const up = path.getTangentAt(t).cross(across).normalize();
      const angle = u * 2 * Math.PI;
      const out = across
        .clone()
        .multiplyScalar(Math.cos(angle))
        .addScaledVector(up, Math.sin(angle))
        .multiplyScalar(thick(t)[0]);
      return path.getPointAt(t).add(out.multiply(new Vector3(...stretch)));
    },
    10,
    14,
  );
}

/** Return a flat-faced box rotated about z: knots and bows of stiff cloth. */
export function box(centre: Vector3, size: readonly [number, number, number], turnZ: number): Surface {
  return () => boxMesh(centre, size, new Quaternion().setFromAxisAngle(new Vector3(0, 0, 1), turnZ));
}

function boxMesh(centre: Vector3, size: readonly [number, number, number], turn: Quaternion): SurfaceMesh {
  const mesh: SurfaceMesh = { positions: [], normals: [], uvs: [], indices: [] };
  for (let axis = 0; axis < 3; axis++) {
    for (const sign of [1, -1]) {
      const first = mesh.positions.length / 3;
      const normal = new Vector3().setComponent(axis, sign).applyQuaternion(turn);
      for (const [a, b] of [
        [-1, -1],
        [1, -1],
        [1, 1],
        [-1, 1],
      ]) {
        const corner = new Vector3().setComponent(axis, sign * size[axis] * 0.5);
        corner.setComponent((axis + 1) % 3, a * size[(axis + 1) % 3] * 0.5);
        corner.setComponent((axis + 2) % 3, b * size[(axis + 2) % 3] * 0.5);
        corner.applyQuaternion(turn).add(centre);
        mesh.positions.push(corner.x, corner.y, corner.z);
        mesh.normals.push(normal.x, normal.y, normal.z);
        mesh.uvs.push((a + 1) / 2, (b + 1) / 2);
      }
      const [a, b, c, d] = sign > 0 ? [0, 1, 2, 3] : [3, 2, 1, 0];
      mesh.indices.push(first + a, first + b, first + c, first + a, first + c, first + d);
    }
  }
  return mesh;
}
