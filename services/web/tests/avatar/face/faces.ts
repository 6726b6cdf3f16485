/** Faces of performers with given weights. */
import { AXIS_COUNT, EXPRESSIONS, expressionIndex, type FacePose, faceExpressionNames } from "../../../src/motion/face";

/** Return a face with the axes of some expressions, and their weights. */
export function faceOf(weights: Readonly<Record<string, number>>): FacePose {
  const wanted = Object.keys(weights);
  const axes = Array.from({ length: AXIS_COUNT }, (_, axis) => axis).filter((axis) =>
    faceExpressionNames({ axes: [axis] }).some((name) => wanted.includes(name)),
  );
  const all = new Float64Array(EXPRESSIONS.length);
  for (const [name, weight] of Object.entries(weights)) all[expressionIndex(name)] = weight;
  return { face: { axes }, weights: all };
}
