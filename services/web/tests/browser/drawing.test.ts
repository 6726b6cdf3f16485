/** What is drawn, and when: without a graphics processor each frame counts, and on a phone each one costs battery. */
import { expect, test } from "vitest";
import { describeInBrowser } from "./browser-suite";
import { evaluateInEngine, waitInEngine } from "./engine-probe";
import {
  LEFT_HAND,
  pauseAtStart,
  readPrograms,
  ringPosition,
  tapKey,
  waitForDraw,
  waitForFirstPose,
  waitForHold,
} from "./page-probe";

/** Callbacks without a frame after which a stage counts as still. */
const STILL_CALLBACKS = 15;
/** Callbacks over which the messages to the page are counted. */
const COUNTED_CALLBACKS = 60;

describeInBrowser("drawing", { server: "open" }, ({ open }) => {
  test("a paused stage is drawn in the best quality, then only when something moves", async () => {
    const page = await open("", { colorScheme: "dark" });
    await waitForFirstPose(page);
    await pauseAtStart(page);
    const width = await page.locator("#stage").evaluate((canvas) => canvas.clientWidth);
    await waitInEngine(page, (width) => globalThis.bunraku.stage.renderer.domElement.width === width, width);
    await waitInEngine(
      page,
      (callbacks) => {
        const { renderer } = globalThis.bunraku.stage;
        return new Promise<boolean>((resolve) => {
          const { frame } = renderer.info.render;
          let left = callbacks;
          const step = () => {
            if (renderer.info.render.frame !== frame) resolve(false);
            else if (--left > 0) requestAnimationFrame(step);
            else resolve(true);
          };
          requestAnimationFrame(step);
        });
      },
      STILL_CALLBACKS,
    );
    const frame = await evaluateInEngine(page, () => globalThis.bunraku.stage.renderer.info.render.frame);
    const ring = await ringPosition(page, LEFT_HAND);
    await page.mouse.move(ring.x, ring.y);
    await waitInEngine(page, (frame) => globalThis.bunraku.stage.renderer.info.render.frame > frame, frame);
  });

  test("all shaders of the best quality are valid without the code that only avatars need", async () => {
    // three.js reports shader errors on the console, also those of programs that it has deleted since.
    const consoleErrors: string[] = [];
    const page = await open("?quality=best", {
      colorScheme: "dark",
      before: async (page) =>
        void page.on("console", (message) => message.type() === "error" && consoleErrors.push(message.text())),
    });
    await waitForFirstPose(page);
    await tapKey(page, "Digit2");
    await waitForHold(page, LEFT_HAND);
    await waitInEngine(page, () => globalThis.bunraku.stage.scene.getObjectByName("floor") !== undefined);
    await waitForDraw(page);
    const programs = await readPrograms(page);
    for (const key of [/,figure$/, /,figure-mirrored$/, /^depth,/])
      expect(programs.some((program) => key.test(program.key))).toBe(true);
    expect(programs.filter(({ isValid }) => !isValid)).toEqual([]);
    expect(consoleErrors).toEqual([]);
  });

  test("the page is told of a state once the canvas shows it", async () => {
    const page = await open("", { colorScheme: "dark" });
    await waitForFirstPose(page);
    const { shown, told } = await evaluateInEngine(
      page,
      (callbacks) =>
        new Promise<{ shown: number; told: number }>((resolve) => {
          const { stage } = globalThis.bunraku;
          const draw = stage.draw.bind(stage);
          const send = globalThis.postMessage.bind(globalThis);
          const counts = { shown: 0, told: 0 };
          globalThis.postMessage = (event: { type?: string }) => {
            if (event.type === "frame") counts.told++;
            send(event);
          };
          let left = callbacks;
          stage.draw = (...state) => {
            if (left-- === 0) {
              [stage.draw, globalThis.postMessage] = [draw, send];
              resolve(counts);
            }
            draw(...state);
            if (left >= 0 && stage.isUpToDate) counts.shown++;
          };
        }),
      COUNTED_CALLBACKS,
    );
    expect(told).toBeGreaterThan(0);
    expect(told).toBeLessThanOrEqual(shown);
  });

  test("edges are smooth without a graphics processor", async () => {
    const page = await open("", { colorScheme: "dark" });
    await waitForFirstPose(page);
    const { smoothed, unsmoothed } = await evaluateInEngine(page, async () => {
      const { stage } = globalThis.bunraku;
      const { renderer, scene, audience } = stage;
      const canvas = renderer.domElement;
      /** Count neighbours in a row whose luma differs by more than a third of the range. */
      const countJumps = () => {
        const context = new OffscreenCanvas(canvas.width, canvas.height).getContext("2d")!;
        context.drawImage(canvas, 0, 0);
        const { data, width } = context.getImageData(0, 0, canvas.width, canvas.height);
        const luma = (pixel: number) =>
          0.299 * data[4 * pixel] + 0.587 * data[4 * pixel + 1] + 0.114 * data[4 * pixel + 2];
        let jumps = 0;
        for (let pixel = 1; pixel < data.length / 4; pixel++)
          if (pixel % width > 0 && Math.abs(luma(pixel) - luma(pixel - 1)) > 85) jumps++;
        return jumps;
      };
      // A canvas shows its frame only until the end of the task that drew it.
      return new Promise<{ smoothed: number; unsmoothed: number }>((resolve) => {
        const draw = stage.draw.bind(stage);
        stage.draw = (...state) => {
          const { frame } = renderer.info.render;
          draw(...state);
          if (renderer.info.render.frame === frame) return;
          stage.draw = draw;
          const smoothed = countJumps();
          renderer.render(scene, audience.camera);
          resolve({ smoothed, unsmoothed: countJumps() });
        };
      });
    });
    expect(unsmoothed).toBeGreaterThan(50);
    expect(smoothed / unsmoothed).toBeLessThan(0.7);
  });

  test("edges that reach the border of the picture leave no line on it", async () => {
    const page = await open("", { colorScheme: "dark" });
    await waitForFirstPose(page);
    await pauseAtStart(page);
    const differences = await evaluateInEngine(page, async () => {
      const { stage } = globalThis.bunraku;
      const { renderer, scene, audience } = stage;
      const canvas = renderer.domElement;
      /** Return the mean value of a row of the picture. */
      const rowMean = (row: number) => {
        const context = new OffscreenCanvas(canvas.width, canvas.height).getContext("2d")!;
        context.drawImage(canvas, 0, 0);
        const { data } = context.getImageData(0, row, canvas.width, 1);
        return data.reduce((sum, value) => sum + value, 0) / data.length;
      };
      const rows = [0, canvas.height - 1];
      return new Promise<number[]>((resolve) => {
        const draw = stage.draw.bind(stage);
        stage.draw = (...state) => {
          const { frame } = renderer.info.render;
          // So near that the figure is higher than the picture.
          audience.camera.zoom = 4;
          audience.camera.updateProjectionMatrix();
          draw(...state);
          if (renderer.info.render.frame === frame) return;
          stage.draw = draw;
          const smoothed = rows.map(rowMean);
          renderer.render(scene, audience.camera);
          audience.camera.zoom = 1;
          audience.camera.updateProjectionMatrix();
          resolve(rows.map((row, at) => Math.abs(smoothed[at] - rowMean(row))));
        };
      });
    });
    expect(Math.max(...differences)).toBeLessThan(0.5);
  });
});
