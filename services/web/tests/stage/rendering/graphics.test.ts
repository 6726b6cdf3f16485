import { afterEach, expect, test, vi } from "vitest";
import { openGraphics } from "../../../src/stage/rendering/graphics";

afterEach(() => void vi.unstubAllGlobals());

/** Create a canvas for a driver name (null: no WebGL 2) and record the requested context attributes. */
function canvasOf(driver: string | null): {
  canvas: HTMLCanvasElement;
  requested: WebGLContextAttributes[];
  lost: () => number;
} {
  const requested: WebGLContextAttributes[] = [];
  let lost = 0;
  const context = {
    getExtension: (name: string) =>
      name === "WEBGL_lose_context" ? { loseContext: () => lost++ } : { UNMASKED_RENDERER_WEBGL: 1 },
    getParameter: () => driver,
  };
  const canvas = (onRequest: (attributes: WebGLContextAttributes) => void) => ({
    getContext(_: string, attributes: WebGLContextAttributes = {}) {
      onRequest(attributes);
      return driver === null ? null : context;
    },
  });
  vi.stubGlobal("document", { createElement: () => canvas(() => undefined) });
  return {
    canvas: canvas((attributes) => void requested.push(attributes)) as unknown as HTMLCanvasElement,
    requested,
    lost: () => lost,
  };
}

test("a graphics processor gets antialiasing, and the probe context is lost", () => {
  const { canvas, requested, lost } = canvasOf("Mali-G78");
  expect(openGraphics(canvas).quality.quality.simpleMaterials).toBe(false);
  expect(requested).toEqual([{ antialias: true, powerPreference: "high-performance" }]);
  expect(lost()).toBe(1);
});

test("software rendering gets no antialiasing of the context unless quality is pinned", () => {
  const { canvas, requested } = canvasOf("Google SwiftShader");
  expect(openGraphics(canvas).quality.quality.simpleMaterials).toBe(true);
  expect(openGraphics(canvas, true).quality.quality.simpleMaterials).toBe(false);
  expect(requested.map(({ antialias }) => antialias)).toEqual([false, true]);
});

test("a browser without WebGL 2 is reported", () => {
  const { canvas } = canvasOf(null);
  expect(() => openGraphics(canvas)).toThrow("does not support WebGL 2");
});
