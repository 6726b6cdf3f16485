import { expect, test } from "vitest";
import { GltfJson, invalidField, tooMuch, wholeNumber } from "../../../src/avatar/gltf/schema";

test("references name the field and what does not exist", () => {
  const json = new GltfJson({ nodes: [{}, {}], meshes: 7 });
  expect(json.reference("nodes", 1, "scene")).toBe(1);
  expect(json.optionalReference("nodes", undefined, "scene")).toBe(null);
  expect(() => json.reference("nodes", 2, "scenes[0].nodes[0]")).toThrow("scenes[0].nodes[0] refers to nodes 2");
  expect(() => json.reference("meshes", 0, "nodes[0].mesh")).toThrow("nodes[0].mesh refers to meshes 0");
  expect(json.item("meshes", 0)).toEqual({});
});

test.each([[-1], [1.5], ["1"], [null], [1e300], [[0]]])("%j is no index", (value) => {
  expect(() => wholeNumber(value, "accessors[3].count")).toThrow("accessors[3].count is ");
});

test("a missing number has its default, or is missing", () => {
  expect(wholeNumber(undefined, "byteOffset", 0)).toBe(0);
  expect(() => wholeNumber(undefined, "byteLength")).toThrow("byteLength is missing");
});

test("errors quote little of a value", () => {
  expect(invalidField("uri", "x".repeat(1000)).detail.length).toBeLessThan(100);
  expect(tooMuch("images[0]", "5 GB", "1 GB").detail).toBe("images[0]: 5 GB; the limit is 1 GB");
});
