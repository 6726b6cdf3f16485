/** Canvases of the stage, which may be drawn by a worker. */

/** Canvas of a page, or one whose control was transferred to a worker. */
export type StageCanvas = HTMLCanvasElement | OffscreenCanvas;

/** Create a canvas that is in no document. */
export function createCanvas(width: number, height: number): StageCanvas {
  // In a page an element, since some browsers offer WebGL on elements alone.
  if (typeof document === "undefined") return new OffscreenCanvas(width, height);
  const canvas = document.createElement("canvas");
  [canvas.width, canvas.height] = [width, height];
  return canvas;
}

/** Encode the content of a canvas as PNG; null if the browser cannot. */
export function encodePng(canvas: StageCanvas): Promise<Blob | null> {
  return "convertToBlob" in canvas
    ? canvas.convertToBlob({ type: "image/png" }).catch(() => null)
    : new Promise((done) => canvas.toBlob(done, "image/png"));
}
