/** Open folding fan: vermilion with a sun of gold leaf in front, gold leaf with a vermilion sun behind. */
import { Vector3 } from "three";
import { ball } from "../puppet/surface";
import { PROP_FINISH } from "./prop-finish";
import { PropMesh } from "./prop-mesh";

const FOLDS = 30;
const FOLD_RAD = (5 * Math.PI) / 180;
/** The pivot, just behind the grip: the hand covers it. */
const PIVOT = new Vector3(0, -0.025, 0);
/** Radii of the leaf from the pivot: inner edge, inner side of the border, outer edge. */
const [INNER_M, BORDER_M, OUTER_M] = [0.13, 0.304, 0.315];
/** The sun: distance from the pivot, and the folds to each side that touch it. */
const SUN_M = 0.22;
const SUN_FOLDS = 4;
/** Height of the folds at the outer edge. */
const FOLD_DEPTH_M = 0.005;

export function createFan(): PropMesh {
  const mesh = new PropMesh();
  const { vermilion, goldLeaf, lacquer, bamboo, gold } = PROP_FINISH;
  const columns = Array.from({ length: FOLDS + 1 }, (_, fold) => {
    const [inside, outside] = sunSpan(fold - FOLDS / 2);
    return [INNER_M, inside, outside, BORDER_M, OUTER_M].map((radius) => leafPoint(fold, radius));
  });
  const bands = [
    [vermilion, goldLeaf],
    [goldLeaf, vermilion],
    [vermilion, goldLeaf],
    [goldLeaf, vermilion],
  ];
  for (let fold = 0; fold < FOLDS; fold++)
    bands.forEach(([front, back], band) => {
      const [left, right] = [columns[fold], columns[fold + 1]];
      mesh.addFace([left[band], left[band + 1], right[band + 1], right[band]].toReversed(), front, back);
    });
  for (let fold = 1; fold < FOLDS; fold += 2) {
    const [start, end] = [-0.016, INNER_M + 0.004].map((radius) => leafPoint(fold, radius));
    mesh.addRod(start, end, new Vector3(1, 0, 0), 0.0045, 0.002, bamboo);
  }
  for (const fold of [0, FOLDS]) {
    const [start, end] = [-0.02, OUTER_M + 0.003].map((radius) => leafPoint(fold, radius));
    mesh.addRod(start, end, new Vector3(0, 0, 1), 0.008, 0.011, lacquer);
  }
  mesh.addSolid(ball(PIVOT, 0.007, [1, 1, 1], 8), gold);
  return mesh;
}

/** Return the point of a fold at a distance from the pivot. */
function leafPoint(fold: number, radius: number): Vector3 {
  const angle = (fold - FOLDS / 2) * FOLD_RAD;
  const depth = ((fold % 2 === 0 ? -1 : 1) * FOLD_DEPTH_M * radius) / OUTER_M;
  return new Vector3(Math.sin(angle) * radius, Math.cos(angle) * radius, depth).add(PIVOT);
}

/** Return the distances from the pivot between which the sun is, `folds` from the middle: equal ones beside it. */
function sunSpan(folds: number): readonly [number, number] {
  const [sine, limit] = [Math.sin(folds * FOLD_RAD), Math.sin(SUN_FOLDS * FOLD_RAD)];
  const middle = SUN_M * Math.cos(Math.min(Math.abs(folds), SUN_FOLDS) * FOLD_RAD);
  const half = SUN_M * Math.sqrt(Math.max(limit * limit - sine * sine, 0));
  return [middle - half, middle + half];
}
