import { MToonMaterial } from "@pixiv/three-vrm";
import {
  BoxGeometry,
  Color,
  Group,
  Mesh,
  MeshBasicMaterial,
  type MeshLambertMaterial,
  MeshPhysicalMaterial,
  MeshStandardMaterial,
  Texture,
} from "three";
import { expect, test } from "vitest";
import { dimMToonMaterials, SimpleMaterials, simplifyMaterials } from "../../src/avatar/materials";

test("physical materials can be replaced by simple ones and restored", () => {
  const [glossy, flat] = [
    new MeshStandardMaterial({ color: "#336699", transparent: true, opacity: 0.5 }),
    new MeshBasicMaterial(),
  ];
  const [one, several] = [new Mesh(new BoxGeometry(), glossy), new Mesh(new BoxGeometry(), [flat, glossy])];
  const materials = new SimpleMaterials(new Group().add(one, several));
  materials.useSimple(true);
  const plain = one.material as unknown as MeshLambertMaterial;
  expect([plain.isMeshLambertMaterial, plain.color.getHexString(), plain.opacity, plain.transparent]).toEqual([
    true,
    "336699",
    0.5,
    true,
  ]);
  expect(several.material).toEqual([flat, plain]);
  materials.useSimple(false);
  expect([one.material, several.material]).toEqual([glossy, [flat, glossy]]);
});

test("disposing restores the model's own materials", () => {
  const mesh = new Mesh(new BoxGeometry(), new MeshStandardMaterial());
  const own = mesh.material;
  const materials = new SimpleMaterials(mesh);
  materials.useSimple(true);
  materials.dispose();
  expect(mesh.material).toBe(own);
});

test("MToon materials are dimmed, shades more than lit colours", () => {
  const cartoon = new MToonMaterial();
  cartoon.color = new Color(1, 1, 1);
  cartoon.shadeColorFactor = new Color(1, 1, 1);
  const other = new MeshStandardMaterial({ color: "#ffffff" });
  dimMToonMaterials([cartoon, other]);
  expect(cartoon.color.r).toBeLessThan(1);
  expect(cartoon.shadeColorFactor.r).toBeLessThan(cartoon.color.r);
  expect(other.color.r).toBe(1);
});

test("expensive features are removed, gloss and textures stay", () => {
  const picture = new Texture();
  const glass = new MeshPhysicalMaterial({ transmission: 1, iridescence: 1, dispersion: 2, clearcoat: 0.5 });
  const rough = new MeshStandardMaterial({ bumpMap: picture, map: picture, normalMap: picture, opacity: 0.5 });
  simplifyMaterials([glass, rough, new MeshBasicMaterial()]);
  expect([glass.transmission, glass.iridescence, glass.dispersion, glass.clearcoat]).toEqual([0, 0, 0, 0.5]);
  expect(glass.transparent).toBe(true);
  expect(glass.opacity).toBeGreaterThan(0.1);
  expect(glass.opacity).toBeLessThan(0.5);
  expect([rough.bumpMap, rough.map, rough.normalMap, rough.opacity]).toEqual([null, picture, picture, 0.5]);
});
