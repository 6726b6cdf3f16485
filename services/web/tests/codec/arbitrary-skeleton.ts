/** Arbitrary figures and references for property tests. */

import * as fc from "fast-check";
import { fromRotationVector } from "../../src/motion/rotation";
import { restPose } from "../../src/motion/skeleton";

const arbitraryMetres = fc.oneof(fc.constant(0), fc.double({ min: -3.3, max: 3.3, noNaN: true }));
const arbitraryLengths = fc
  .array(arbitraryMetres, { minLength: 54, maxLength: 54 })
  .map((values) => Float64Array.from(values));

export const arbitraryFigure = fc.record({ offsets: arbitraryLengths, tips: arbitraryLengths });

/** One rotation per joint (72). */
export const arbitraryReference = fc
  .array(fc.double({ min: -2, max: 2, noNaN: true }), { minLength: 54, maxLength: 54 })
  .map((vectors) => {
    const rotations = new Float64Array(72);
    for (let joint = 0; joint < 18; joint++) {
      const [x, y, z] = vectors.slice(joint * 3);
      fromRotationVector(rotations, joint * 4, x, y, z);
    }
    return rotations;
  });

/** Identity rotations (72). */
export const REST_ROTATIONS = restPose().rotations;
