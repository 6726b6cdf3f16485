import { Vector3 } from "three";
import { describe, expect, test } from "vitest";
import { JOINTS, PARENTS, type Figure } from "../../src/motion/skeleton";
import { fitTo, figureScale, restPositions } from "../../src/stage/fit";
import { BONES, puppetGeometry } from "../../src/stage/puppet";
import { CROWN, joint, LEFT_FINGER_TIP } from "../../src/stage/standard";

/** The standard figure, its joints `size` times as far apart. */
function standardFigure(size = 1): Figure {
  const offsets = new Float64Array(54);
  const tips = new Float64Array(54);
  JOINTS.forEach((name, k) => {
    const at = joint(name);
    if (PARENTS[k] >= 0) at.sub(joint(JOINTS[PARENTS[k]]));
    at.multiplyScalar(size).toArray(offsets, k * 3);
  });
  const tip = (name: string, place: Vector3) => place.clone().sub(joint(name)).multiplyScalar(size).toArray(tips, JOINTS.indexOf(name) * 3);
  tip("skullbase", CROWN);
  tip("l_wrist", LEFT_FINGER_TIP);
  tip("r_wrist", LEFT_FINGER_TIP.clone().setX(-LEFT_FINGER_TIP.x));
  for (const name of ["l_midtarsal", "r_midtarsal"]) tips[JOINTS.indexOf(name) * 3 + 2] = 0.07 * size;
  return { offsets, tips };
}

/** A dancer with longer legs and shorter arms than the standard, and broader hips. */
function otherFigure(): Figure {
  const figure = standardFigure();
  const scale = (name: string, axis: number, by: number) => (figure.offsets[JOINTS.indexOf(name) * 3 + axis] *= by);
  for (const side of ["l", "r"]) {
    scale(`${side}_knee`, 1, 1.2);
    scale(`${side}_ankle`, 1, 1.15);
    scale(`${side}_elbow`, 1, 0.8);
    scale(`${side}_hip`, 0, 1.1);
  }
  return figure;
}

describe("the parts on a dancer", () => {
  test("on the standard figure nothing moves", () => {
    const fit = fitTo(standardFigure());
    for (const bone of BONES) {
      const [place, normal] = [new Vector3(0.1, 1.2, 0.05), new Vector3(0.6, 0.8, 0)];
      fit(place, normal, [[bone, 1]]);
      expect(place.distanceTo(new Vector3(0.1, 1.2, 0.05))).toBeLessThan(1e-9);
      expect(normal.distanceTo(new Vector3(0.6, 0.8, 0))).toBeLessThan(1e-9);
    }
  });

  test("every limb ends at the dancer's own joints", () => {
    const figure = otherFigure();
    const fit = fitTo(figure);
    const rest = restPositions(figure);
    for (const [bone, end] of [["l_hip", "l_knee"], ["r_knee", "r_ankle"], ["l_shoulder", "l_elbow"], ["r_elbow", "r_wrist"]]) {
      for (const at of [bone, end]) {
        const place = joint(at);
        fit(place, new Vector3(0, 1, 0), [[bone, 1]]);
        expect(place.distanceTo(rest.get(at) as Vector3)).toBeLessThan(1e-9);
      }
    }
  });

  test("twice the size is twice the scale", () => {
    expect(figureScale(standardFigure())).toBeCloseTo(1);
    expect(figureScale(standardFigure(2))).toBeCloseTo(2);
  });
});

describe("the puppet's geometry", () => {
  const geometry = puppetGeometry(otherFigure());
  const values = (name: string) => geometry.getAttribute(name).array;

  test("stays within the budget of 30,000 triangles", () => {
    expect((geometry.index?.count ?? 0) / 3).toBeLessThan(30_000);
    expect((geometry.index?.count ?? 0) / 3).toBeGreaterThan(20_000);
  });

  test("has finite places, unit normals, and weights that sum to one", () => {
    expect([...values("position")].every(Number.isFinite)).toBe(true);
    const [normals, weights] = [values("normal"), values("skinWeight")];
    for (let i = 0; i < geometry.getAttribute("position").count; i++) {
      expect(Math.hypot(normals[i * 3], normals[i * 3 + 1], normals[i * 3 + 2])).toBeCloseTo(1, 4);
      expect(weights[i * 4] + weights[i * 4 + 1] + weights[i * 4 + 2] + weights[i * 4 + 3]).toBeCloseTo(1, 5);
    }
  });

  test("hangs something on every limb's bone", () => {
    const used = new Set(values("skinIndex"));
    for (const bone of ["l_hip", "r_knee", "l_ankle", "r_midtarsal", "skullbase", "l_elbow", "r_wrist", "l_sleeve"]) {
      expect(used.has(BONES.indexOf(bone))).toBe(true);
    }
  });
});
