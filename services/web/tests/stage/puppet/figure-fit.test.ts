import fc from "fast-check";
import { Vector3 } from "three";
import { describe, expect, test } from "vitest";
import { JOINTS } from "../../../src/motion/skeleton";
import { BONES } from "../../../src/stage/puppet/bones";
import { figureScale, fitToFigure, restPositions } from "../../../src/stage/puppet/figure-fit";
import {
  CROWN,
  HEAD_CENTRE,
  jointPosition,
  LEFT_FINGER_TIP,
  SOLE_HEIGHT_M,
} from "../../../src/stage/puppet/standard-figure";
import { createOtherFigure, createStandardFigure } from "./figures";

describe("parts fitted to a figure", () => {
  test("do not move on the standard figure", () => {
    const fit = fitToFigure(createStandardFigure());
    for (const bone of BONES) {
      const [place, normal] = [new Vector3(0.1, 1.2, 0.05), new Vector3(0.6, 0.8, 0)];
      fit(place, normal, [[bone, 1]]);
      expect(place.distanceTo(new Vector3(0.1, 1.2, 0.05))).toBeLessThan(1e-9);
      expect(normal.distanceTo(new Vector3(0.6, 0.8, 0))).toBeLessThan(1e-9);
    }
  });

  test("end at the figure's own joints", () => {
    const figure = createOtherFigure();
    const fit = fitToFigure(figure);
    const rest = restPositions(figure);
    for (const [bone, end] of [
      ["l_hip", "l_knee"],
      ["r_knee", "r_ankle"],
      ["l_shoulder", "l_elbow"],
      ["r_elbow", "r_wrist"],
    ]) {
      for (const at of [bone, end]) {
        const place = jointPosition(at);
        fit(place, new Vector3(0, 1, 0), [[bone, 1]]);
        expect(place.distanceTo(rest.get(at) as Vector3)).toBeLessThan(1e-9);
      }
    }
  });

  test("have twice the scale at twice the size", () => {
    expect(figureScale(createStandardFigure())).toBeCloseTo(1);
    expect(figureScale(createStandardFigure(2))).toBeCloseTo(2);
  });

  test("have a limited scale on tiny and huge figures", () => {
    expect(figureScale({ offsets: new Float64Array(54), tips: new Float64Array(54) })).toBe(0.2);
    expect(figureScale(createStandardFigure(1000))).toBe(5);
  });

  test("reach the figure's crown and finger tips", () => {
    const figure = createStandardFigure(1.1);
    const fit = fitToFigure(figure);
    const place = LEFT_FINGER_TIP.clone();
    fit(place, new Vector3(0, 1, 0), [["l_wrist", 1]]);
    const wrist = restPositions(figure).get("l_wrist") as Vector3;
    expect(
      place.distanceTo(wrist.clone().add(new Vector3().fromArray(figure.tips, JOINTS.indexOf("l_wrist") * 3))),
    ).toBeLessThan(1e-9);
    const top = CROWN.clone();
    fit(top, new Vector3(0, 1, 0), [["skullbase", 1]]);
    expect(top.distanceTo(CROWN.clone().multiplyScalar(1.1))).toBeLessThan(1e-9);
  });

  test("place the head under the crown, wherever the skull's joint is", () => {
    const [high, low] = [createStandardFigure(), createStandardFigure()];
    const skull = JOINTS.indexOf("skullbase") * 3 + 1;
    low.offsets[skull] -= 0.08;
    low.tips[skull] += 0.08;
    const [one, other] = [high, low].map((figure) => {
      const place = HEAD_CENTRE.clone();
      fitToFigure(figure)(place, new Vector3(0, 0, 1), [["skullbase", 1]]);
      return place;
    });
    expect(one.distanceTo(other)).toBeLessThan(1e-9);
  });

  test("keep soles flat, at a depth proportional to the size", () => {
    const fit = fitToFigure(createStandardFigure(1.3));
    const sole = (name: string, z: number) => {
      const place = jointPosition("l_midtarsal").add(new Vector3(0.01, -SOLE_HEIGHT_M, z));
      fit(place, new Vector3(0, -1, 0), [[name, 1]]);
      return place.y;
    };
    const ball = jointPosition("l_midtarsal").y * 1.3;
    for (const height of [
      sole("l_midtarsal", 0),
      sole("l_midtarsal", 0.06),
      sole("l_ankle", 0),
      sole("l_ankle", -0.15),
    ]) {
      expect(height).toBeCloseTo(ball - SOLE_HEIGHT_M * 1.3, 9);
    }
  });

  test("are finite for any lengths in a file, even zero", () => {
    const lengths = fc.array(fc.oneof(fc.constant(0), fc.double({ min: -3, max: 3, noNaN: true })), {
      minLength: 54,
      maxLength: 54,
    });
    fc.assert(
      fc.property(lengths, lengths, (offsets, tips) => {
        const fit = fitToFigure({ offsets: Float64Array.from(offsets), tips: Float64Array.from(tips) });
        for (const bone of BONES) {
          const [place, normal] = [new Vector3(0.1, 1.2, 0.05), new Vector3(0.6, 0.8, 0)];
          fit(place, normal, [[bone, 1]]);
          expect([...place, ...normal].every(Number.isFinite)).toBe(true);
          expect(normal.length()).toBeCloseTo(1, 6);
        }
      }),
    );
  });
});
