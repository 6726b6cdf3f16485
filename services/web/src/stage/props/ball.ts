/** Temari, a ball wound with threads: zigzag bands around both poles, and a belt at the equator. */
import { Vector3 } from "three";
import { BALL_RADIUS_M } from "../../motion/props";
import type { Finish } from "../puppet/finish";
import { PROP_FINISH } from "./prop-finish";
import { PropMesh } from "./prop-mesh";

const COLUMNS = 32;
const { gold, indigo, vermilion, white } = PROP_FINISH;

/** Threads from a pole to the equator: their outer edge and its zigzag to both sides, degrees from the pole. */
const BANDS: readonly (readonly [edge: number, zigzag: number, finish: Finish])[] = [
  [12, 5, gold],
  [23, 8, vermilion],
  [34, 9, white],
  [43, 9, indigo],
  [53, 9, vermilion],
  [60, 9, gold],
  [78, 0, indigo],
  [82, 0, gold],
  [90, 0, vermilion],
];

export function createBall(): PropMesh {
  const mesh = new PropMesh();
  for (const pole of [1, -1]) {
    let [before, zigzagBefore] = [0, 0];
    for (const [edge, zigzag, finish] of BANDS) {
      for (let column = 0; column < COLUMNS; column++) {
        const point = (at: number, angle: number, by: number) =>
          surfacePoint(at, angle + (at % 2 === 0 ? by : -by), pole);
        const corners = [
          point(column, before, zigzagBefore),
          point(column, edge, zigzag),
          point(column + 1, edge, zigzag),
          point(column + 1, before, zigzagBefore),
        ];
        const facing = pole > 0 ? corners : corners.toReversed();
        mesh.addFace(
          facing,
          finish,
          undefined,
          facing.map((corner) => corner.clone().normalize()),
        );
      }
      [before, zigzagBefore] = [edge, zigzag];
    }
  }
  return mesh;
}

/** Return a point of the ball by its column and its angle from a pole (1 above, -1 below), in degrees. */
function surfacePoint(column: number, degrees: number, pole: number): Vector3 {
  const azimuth = (2 * Math.PI * column) / COLUMNS;
  const angle = (degrees * Math.PI) / 180;
  return new Vector3(
    Math.sin(azimuth) * Math.sin(angle),
    pole * Math.cos(angle),
    Math.cos(azimuth) * Math.sin(angle),
  ).multiplyScalar(BALL_RADIUS_M);
}
