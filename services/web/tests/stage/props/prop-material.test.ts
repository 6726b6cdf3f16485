import { type MeshPhysicalMaterial, Scene, ShaderLib, type WebGLProgramParametersWithUniforms } from "three";
import { expect, test } from "vitest";
import { createPropMaterial, SimplePropMaterial } from "../../../src/stage/props/prop-material";

/** Return the shaders that a material makes of three.js's. */
function patchedShaders(material: MeshPhysicalMaterial): WebGLProgramParametersWithUniforms {
  const { vertexShader, fragmentShader } = ShaderLib.physical;
  const shader = { vertexShader, fragmentShader, uniforms: {} } as WebGLProgramParametersWithUniforms;
  material.onBeforeCompile(shader, undefined as never);
  return shader;
}

test("the material takes roughness, metalness and clearcoat from the vertices", () => {
  const { vertexShader, fragmentShader } = patchedShaders(createPropMaterial());
  expect(vertexShader).toContain("vFinish = finish;");
  for (const line of [
    "float roughnessFactor = vFinish.x;",
    "float metalnessFactor = vFinish.y;",
    "material.clearcoat *= vFinish.z;",
  ])
    expect(fragmentShader).toContain(line);
});

test("the simple material follows the light of the surroundings", () => {
  const material = new SimplePropMaterial();
  const scene = new Scene();
  const levels = [1, 0.2].map((intensity) => {
    scene.environmentIntensity = intensity;
    material.prepare(scene);
    return material.uniforms["ambient"].value as number;
  });
  expect(levels[1] / levels[0]).toBeCloseTo(0.2, 9);
  expect(material.uniforms["spotLights"]).toBeDefined();
});
