import { Texture } from "three";
import { describe, expect, test } from "vitest";
import { BONES, buildPuppetGeometry, PuppetAssets } from "../../../src/stage/puppet/puppet-assets";
import { createOtherFigure, createStandardFigure } from "./figures";

describe("the puppet's geometry", () => {
  const geometry = buildPuppetGeometry(createOtherFigure());
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

test("dancers of equal lengths have one mesh, and it is given back when none of them is left", () => {
  const workshop = new PuppetAssets({ face: new Texture(), asanoha: new Texture() }, { value: 0 });
  const shape = workshop.geometryFor(createStandardFigure());
  expect(workshop.geometryFor(createStandardFigure())).toBe(shape);
  const other = workshop.geometryFor(createOtherFigure());
  expect(other).not.toBe(shape);
  const gone: unknown[] = [];
  for (const one of [shape, other]) one.addEventListener("dispose", () => gone.push(one));
  workshop.retainOnly([createStandardFigure()]);
  expect(gone).toEqual([other]);
  expect(workshop.geometryFor(createStandardFigure())).toBe(shape);
});
