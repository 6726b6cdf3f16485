import { type BufferAttribute, type BufferGeometry, Texture } from "three";
import { describe, expect, test, vi } from "vitest";
import { BONES } from "../../../src/stage/puppet/bones";
import { MATERIAL_PARTS, PATTERN } from "../../../src/stage/puppet/finish";
import { GeometryBuilder } from "../../../src/stage/puppet/geometry-builder";
import { PuppetAssets } from "../../../src/stage/puppet/puppet-assets";
import { buildPuppetGeometry, preparePuppetGeometry } from "../../../src/stage/puppet/puppet-geometry";
import { ControlBars } from "../../../src/stage/strings/control-bar";
import { createOtherFigure, createStandardFigure } from "./figures";

function geometryAttribute(attributes: BufferGeometry["attributes"], name: string) {
  return attributes[name] as BufferAttribute;
}

describe("the puppet's geometry", () => {
  const geometry = buildPuppetGeometry(createOtherFigure(), "full");
  const values = (name: string) => geometry.getAttribute(name).array;

  test("stays with its shadow, its reflection and three control bars within the stage's 80,000 triangles", () => {
    const count = ({ index }: BufferGeometry) => (index?.count ?? 0) / 3;
    const stage = 3 * count(geometry) + 3 * count(new ControlBars().mesh.geometry);
    // threads, rings, floor and backdrop
    expect(stage).toBeLessThan(80_000 - 400);
    expect(stage).toBeGreaterThan(60_000);
  });

  test("has a coarse mesh of some of the vertices with half of the triangles", () => {
    const coarse = buildPuppetGeometry(createOtherFigure(), "coarse");
    const verticesOf = ({ attributes }: typeof geometry) =>
      Array.from({ length: attributes["position"].count }, (_, vertex) =>
        ["position", "normal", "color", "finish", "pattern", "skinIndex", "skinWeight"]
          .map((name) => {
            const { array, itemSize } = geometryAttribute(attributes, name);
            return array.slice(vertex * itemSize, (vertex + 1) * itemSize).join();
          })
          .join(" "),
      );
    const all = new Set(verticesOf(geometry));
    expect(verticesOf(coarse).filter((vertex) => !all.has(vertex))).toEqual([]);
    expect((coarse.index?.count ?? 0) / (geometry.index?.count ?? 0)).toBeLessThan(0.6);
    expect((coarse.index?.count ?? 0) / (geometry.index?.count ?? 0)).toBeGreaterThan(0.4);
  });

  test("has the triangles of the face, and no others, in the group of its material", () => {
    const [patterns, { array }] = [values("pattern"), geometry.index as BufferAttribute];
    for (const { start, count, materialIndex = 0 } of geometry.groups)
      for (const vertex of array.slice(start, start + count))
        expect(MATERIAL_PARTS[materialIndex]).toBe(patterns[3 * vertex + 2] === PATTERN.face ? "face" : "faceless");
    expect(geometry.groups.reduce((sum, { count }) => sum + count, 0)).toBe(array.length);
    expect(geometry.groups.every(({ count }) => count > 0)).toBe(true);
  });

  test("has finite positions, unit normals and weights that sum to one", () => {
    expect([...values("position")].every(Number.isFinite)).toBe(true);
    const [normals, weights] = [values("normal"), values("skinWeight")];
    for (let i = 0; i < geometry.getAttribute("position").count; i++) {
      expect(Math.hypot(normals[i * 3], normals[i * 3 + 1], normals[i * 3 + 2])).toBeCloseTo(1, 4);
      expect(weights[i * 4] + weights[i * 4 + 1] + weights[i * 4 + 2] + weights[i * 4 + 3]).toBeCloseTo(1, 5);
    }
  });

  test("has vertices on every limb's bone", () => {
    const used = new Set(values("skinIndex"));
    for (const bone of ["l_hip", "r_knee", "l_ankle", "r_midtarsal", "skullbase", "l_elbow", "r_wrist", "l_sleeve"]) {
      expect(used.has(BONES.indexOf(bone))).toBe(true);
    }
  });
});

test("figures of equal lengths share a mesh, which is disposed of after use", () => {
  const assets = new PuppetAssets({ face: new Texture(), asanoha: new Texture() }, { value: 0 });
  const shape = assets.geometryFor(createStandardFigure(), "full");
  expect(assets.geometryFor(createStandardFigure(), "full")).toBe(shape);
  expect(assets.geometryFor(createStandardFigure(), "coarse")).not.toBe(shape);
  const other = assets.geometryFor(createOtherFigure(), "full");
  expect(other).not.toBe(shape);
  const disposed: unknown[] = [];
  for (const one of [shape, other]) one.addEventListener("dispose", () => disposed.push(one));
  assets.retainOnly([createStandardFigure()]);
  expect(disposed).toEqual([other]);
  expect(assets.geometryFor(createStandardFigure(), "full")).toBe(shape);
});

test("a mesh that was built ahead is used once, and only for its figure and detail", () => {
  const create = () => new PuppetAssets({ face: new Texture(), asanoha: new Texture() }, { value: 0 });
  const build = vi.spyOn(GeometryBuilder.prototype, "build");
  preparePuppetGeometry(createStandardFigure(), "coarse");
  preparePuppetGeometry(createStandardFigure(), "coarse");
  expect(build).toHaveBeenCalledTimes(1);
  const ahead = create().geometryFor(createStandardFigure(), "coarse");
  expect(build).toHaveBeenCalledTimes(1);
  expect(create().geometryFor(createStandardFigure(), "coarse")).not.toBe(ahead);
  preparePuppetGeometry(createStandardFigure(), "coarse");
  const full = create().geometryFor(createStandardFigure(), "full");
  expect(full.index?.count).toBeGreaterThan(ahead.index?.count ?? 0);
  expect(build).toHaveBeenCalledTimes(4);
  build.mockRestore();
});
