/** Case `software`: what people see without a graphics processor, in the size of a usual window. */
import { evaluateInEngine } from "../../browser/engine-probe";
import { waitForFirstPose } from "../../browser/page-probe";
import { type BenchContext, type BenchFigures, roundTo, withPage } from "./bench";

const VIEWPORT = { width: 1440, height: 900 };
/** Time in which the quality settles, and duration of the measurement, in milliseconds. */
const SETTLING_MS = 12_000;
const MEASURED_MS = 15_000;
const SSIM_PICTURES = 3;

/** Run the case `software`. */
export function benchSoftwareRendering(bench: BenchContext): Promise<BenchFigures> {
  return withPage(bench, { viewport: VIEWPORT }, async ({ page }) => {
    await page.goto(`${bench.url}/`);
    await waitForFirstPose(page);
    await page.waitForTimeout(SETTLING_MS);
    const { frames, seconds, resolution, renderer } = await evaluateInEngine(
      page,
      async ({ duration, width }) => {
        const { stage } = globalThis.bunraku;
        const { renderer } = stage;
        let frames = 0;
        const draw = stage.draw.bind(stage);
        stage.draw = (...state) => {
          const before = renderer.info.render.frame;
          draw(...state);
          if (renderer.info.render.frame !== before) frames++;
        };
        const start = performance.now();
        const widths: number[] = [];
        while (performance.now() - start < duration) {
          await new Promise(requestAnimationFrame);
          widths.push(renderer.domElement.width / width);
        }
        const gl = renderer.getContext();
        const names = gl.getExtension("WEBGL_debug_renderer_info");
        return {
          frames,
          seconds: (performance.now() - start) / 1000,
          resolution: widths.sort((a, b) => a - b)[widths.length >> 1],
          renderer: names ? String(gl.getParameter(names.UNMASKED_RENDERER_WEBGL)) : "unknown",
        };
      },
      { duration: MEASURED_MS, width: VIEWPORT.width },
    );
    bench.note(`software: ${renderer}`);
    // The first picture loads what takes pictures: it would show a later moment.
    await evaluateInEngine(page, async () => void (await globalThis.bunraku.stage.takePicture()));
    const similarities: number[] = [];
    for (let picture = 0; picture < SSIM_PICTURES; picture++)
      similarities.push(await evaluateInEngine(page, comparePictures, VIEWPORT));
    bench.note(`software: SSIM of ${similarities.map((value) => roundTo(value, 3)).join(", ")}`);
    return {
      software_fps: roundTo(frames / seconds),
      software_resolution: roundTo(resolution, 2),
      software_ssim: roundTo(Math.min(...similarities), 3),
    };
  });
}

/**
 * In the engine: return the structural similarity (Wang et al. 2004, Gaussian window with sigma 1.5, luma) of a frame as
 * drawn and as a picture in full quality, over the box of the first performer. `width` and `height` are the size of the
 * stage in CSS pixels.
 */
async function comparePictures({ width, height }: typeof VIEWPORT): Promise<number> {
  const { stage } = globalThis.bunraku;
  const canvas = stage.renderer.domElement;
  // The picture is drawn in the task that drew the frame, so that both show the same moment.
  const { drawn, full } = await new Promise<{ drawn: Promise<ImageBitmap>; full: Promise<Blob> }>((resolve) => {
    const { draw } = stage;
    stage.draw = (...state) => {
      const before = stage.renderer.info.render.frame;
      draw.apply(stage, state);
      if (stage.renderer.info.render.frame === before) return;
      stage.draw = draw;
      resolve({ drawn: createImageBitmap(canvas), full: stage.takePicture() });
    };
  });
  const joints = ["skullbase", "l_wrist", "r_wrist", "l_ankle", "r_ankle", "l_elbow", "r_elbow"].map((name) => {
    const at = stage.rig.group.position.clone().setFromMatrixPosition(stage.performers[0].joint(name));
    return stage.toScreen(at);
  });
  const margin = 0.07 * height;
  const left = Math.floor(Math.min(...joints.map(({ x }) => x)) - margin);
  const top = Math.floor(Math.min(...joints.map(({ y }) => y)) - 1.8 * margin);
  const columns = Math.ceil(Math.max(...joints.map(({ x }) => x)) + margin) - left;
  const rows = Math.ceil(Math.max(...joints.map(({ y }) => y)) + margin) - top;
  const luma = (picture: ImageBitmap): Float64Array => {
    const context = new OffscreenCanvas(width, height).getContext("2d", { willReadFrequently: true })!;
    context.imageSmoothingQuality = "high";
    context.drawImage(picture, 0, 0, width, height);
    const { data } = context.getImageData(left, top, columns, rows);
    return Float64Array.from({ length: columns * rows }, (_, at) => {
      const pixel = at * 4;
      return 0.299 * data[pixel] + 0.587 * data[pixel + 1] + 0.114 * data[pixel + 2];
    });
  };
  const first = luma(await drawn);
  const second = luma(await createImageBitmap(await full));
  const kernel = Array.from({ length: 11 }, (_, at) => Math.exp(-((at - 5) ** 2) / (2 * 1.5 ** 2)));
  const total = kernel.reduce((sum, weight) => sum + weight, 0);
  const blur = (values: Float64Array): Float64Array => {
    const convolve = (source: Float64Array, step: number, size: number, position: (at: number) => number) =>
      source.map((_, at) =>
        kernel.reduce((sum, weight, tap) => {
          const offset = Math.min(Math.max(position(at) + tap - 5, 0), size - 1) - position(at);
          return sum + (weight / total) * source[at + offset * step];
        }, 0),
      );
    const across = convolve(values, 1, columns, (at) => at % columns);
    return convolve(across, columns, rows, (at) => Math.floor(at / columns));
  };
  const times = (a: Float64Array, b: Float64Array) => a.map((value, at) => value * b[at]);
  const [meanA, meanB] = [blur(first), blur(second)];
  const [squareA, squareB, product] = [
    blur(times(first, first)),
    blur(times(second, second)),
    blur(times(first, second)),
  ];
  const [c1, c2] = [(0.01 * 255) ** 2, (0.03 * 255) ** 2];
  const map = meanA.map((a, at) => {
    const b = meanB[at];
    const covariance = product[at] - a * b;
    const variances = squareA[at] - a * a + squareB[at] - b * b;
    return ((2 * a * b + c1) * (2 * covariance + c2)) / ((a * a + b * b + c1) * (variances + c2));
  });
  return map.reduce((sum, value) => sum + value, 0) / map.length;
}
