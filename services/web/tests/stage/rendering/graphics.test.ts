import { afterEach, expect, test, vi } from "vitest";
import { openGraphics } from "../../../src/stage/rendering/graphics";

afterEach(() => void vi.unstubAllGlobals());

/** A canvas in a browser whose driver has this name, null where there is no WebGL 2; and what its graphics were asked for. */
function canvasOf(driver: string | null): {
  canvas: HTMLCanvasElement;
  asked: WebGLContextAttributes[];
  lost: () => number;
} {
  const asked: WebGLContextAttributes[] = [];
  let lost = 0;
  const context = {
    getExtension: (name: string) =>
      name === "WEBGL_lose_context" ? { loseContext: () => lost++ } : { UNMASKED_RENDERER_WEBGL: 1 },
    getParameter: () => driver,
  };
  const canvas = (told: (attributes: WebGLContextAttributes) => void) => ({
    getContext(_: string, attributes: WebGLContextAttributes = {}) {
      told(attributes);
      return driver === null ? null : context;
    },
  });
  vi.stubGlobal("document", { createElement: () => canvas(() => undefined) });
  return {
    canvas: canvas((attributes) => void asked.push(attributes)) as unknown as HTMLCanvasElement,
    asked,
    lost: () => lost,
  };
}

test("edges are smooth where a graphics processor draws, and what asked for its name is given back", () => {
  const { canvas, asked, lost } = canvasOf("Mali-G78");
  expect(openGraphics(canvas).quality.quality.simpleMaterials).toBe(false);
  expect(asked).toEqual([{ antialias: true, powerPreference: "high-performance" }]);
  expect(lost()).toBe(1);
});

test("a machine that draws in software is spared smooth edges, but not in a picture", () => {
  const { canvas, asked } = canvasOf("Google SwiftShader");
  expect(openGraphics(canvas).quality.quality.simpleMaterials).toBe(true);
  expect(openGraphics(canvas, true).quality.quality.simpleMaterials).toBe(false);
  expect(asked.map(({ antialias }) => antialias)).toEqual([false, true]);
});

test("a browser without WebGL 2 is told of", () => {
  const { canvas } = canvasOf(null);
  expect(() => openGraphics(canvas)).toThrow("this browser has no WebGL 2");
});
