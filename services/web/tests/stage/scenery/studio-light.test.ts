import { Scene } from "three";
import { expect, test } from "vitest";
import { studioBackground, studioPanes } from "../../../src/stage/scenery/environment-map";
import { LOOKS } from "../../../src/stage/scenery/look";
import { createStudioUniforms, updateStudio } from "../../../src/stage/scenery/studio-light";

test.each(["night", "day"] as const)("panes of the %s look are directions with solid angles", (theme) => {
  const uniforms = createStudioUniforms();
  updateStudio(uniforms, LOOKS[theme], new Scene());
  const panes = studioPanes(LOOKS[theme]);
  expect(panes.length).toBeLessThanOrEqual(uniforms.panes.value.length);
  panes.forEach(([, , width, height, place], at) => {
    const { x, y, z, w } = uniforms.panes.value[at];
    expect(Math.hypot(x, y, z)).toBeCloseTo(1);
    expect(Math.sign(x)).toBe(Math.sign(place[0]));
    expect(w).toBeLessThan(2 * Math.PI);
    expect(w).toBeLessThan((width * height) / Math.hypot(...place) ** 2);
  });
});

test("light of the studio is proportional to the intensity of the environment, and missing panes are dark", () => {
  const [bright, dim] = [createStudioUniforms(), createStudioUniforms()];
  const scene = new Scene();
  updateStudio(bright, LOOKS.day, scene);
  scene.environmentIntensity = 0.5;
  updateStudio(dim, LOOKS.day, scene);
  bright.paneColours.value.forEach(({ g }, at) => expect(dim.paneColours.value[at].g).toBeCloseTo(g / 2));
  expect(bright.paneColours.value.at(-1)?.getHexString()).toBe(studioBackground(LOOKS.day).slice(1));
  for (let missing = studioPanes(LOOKS.day).length; missing < bright.panes.value.length; missing++)
    expect(bright.paneColours.value[missing].getHex()).toBe(0);
});
