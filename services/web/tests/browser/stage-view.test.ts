/** The stage without the page around it, as streaming software shows it. */
import { inflateSync } from "node:zlib";
import type { Page } from "playwright-core";
import { expect, test } from "vitest";
import { describeInBrowser } from "./browser-suite";
import { evaluateInEngine, waitInEngine } from "./engine-probe";
import { LEFT_HAND, pauseAtStart, waitForFirstPose } from "./page-probe";

const SIZE = { width: 400, height: 400 };

/** Share of the pixels of a picture, and its most extreme values; colours are multiplied by alpha. */
interface AlphaCounts {
  readonly [name: string]: number;
  readonly transparent: number;
  readonly opaque: number;
  readonly partial: number;
  /** Largest difference by which a colour is stronger than its alpha, in units of 1/255. */
  readonly excess: number;
  /** Largest colour of a pixel whose alpha is 0. */
  readonly hidden: number;
}

/** Count the pixels of the drawing buffer, in the frame in which it was drawn. */
function countDrawnPixels(page: Page): Promise<AlphaCounts> {
  return evaluateInEngine(
    page,
    () =>
      new Promise<AlphaCounts>((resolve) => {
        const { stage } = globalThis.bunraku;
        const { info } = stage.renderer;
        const gl = stage.renderer.getContext();
        const draw = stage.draw.bind(stage);
        // The browser may clear the buffer as soon as the task that has drawn it ends.
        stage.draw = (...state) => {
          const { frame } = info.render;
          draw(...state);
          if (info.render.frame === frame || gl.isContextLost()) return;
          stage.draw = draw;
          const { drawingBufferWidth: width, drawingBufferHeight: height } = gl;
          const pixels = new Uint8Array(width * height * 4);
          gl.readPixels(0, 0, width, height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
          const counts = { transparent: 0, opaque: 0, partial: 0, excess: 0, hidden: 0 };
          for (let at = 0; at < pixels.length; at += 4) {
            const strongest = Math.max(pixels[at], pixels[at + 1], pixels[at + 2]);
            const alpha = pixels[at + 3];
            counts[alpha === 0 ? "transparent" : alpha === 255 ? "opaque" : "partial"] += 4 / pixels.length;
            counts.excess = Math.max(counts.excess, strongest - alpha);
            if (alpha === 0) counts.hidden = Math.max(counts.hidden, strongest);
          }
          resolve(counts);
        };
      }),
  );
}

describeInBrowser("stage view", { server: "open" }, (fixture) => {
  const open = (query: string, theme: "dark" | "light" = "dark") =>
    fixture.open(`${fixture.url}/?session=${fixture.session}&view=stage&${query}`, {
      viewport: SIZE,
      colorScheme: theme,
    });

  test.each(["dark", "light"] as const)("a transparent stage has premultiplied alpha, %s", async (theme) => {
    const page = await open("background=transparent", theme);
    await waitForFirstPose(page);
    // Another page pulls a hand, whose thread glows.
    const other = await fixture.open(`${fixture.url}/?session=${fixture.session}`, { viewport: SIZE });
    await waitForFirstPose(other);
    await other.keyboard.down("KeyW");
    await other.keyboard.press("Digit2");
    await waitInEngine(page, (limb) => globalThis.bunraku.stage.strings.barPosition(limb) !== null, LEFT_HAND);
    const drawn = await countDrawnPixels(page);
    const counts = JSON.stringify(drawn);
    expect(drawn.transparent, counts).toBeGreaterThan(0.4);
    expect(drawn.opaque, counts).toBeGreaterThan(0.03);
    expect(drawn.partial, counts).toBeGreaterThan(0.001);
    // Rounding of the blended colours and of alpha.
    expect(drawn.excess, counts).toBeLessThanOrEqual(2);
    expect(drawn.hidden, counts).toBeLessThanOrEqual(1);
    // The page around the canvas is transparent too.
    const alphas = cornerAlphas(await page.screenshot({ omitBackground: true }));
    expect(alphas).toEqual([0, 0, 0, 0]);
    await other.close();
  });

  test("it has no controls and takes no limb, and its own backdrop without a choice", async () => {
    const page = await open("");
    await waitForFirstPose(page);
    expect(await page.getByRole("button").count()).toBe(0);
    expect(await page.evaluate(() => document.body.innerText.trim())).toBe("");
    await page.keyboard.press("Digit2");
    await page.mouse.click(200, 200);
    expect(await evaluateInEngine(page, () => globalThis.bunraku.hands.isHoldingAny)).toBe(false);
    await waitInEngine(page, () => globalThis.bunraku.stage.scene.getObjectByName("scenery") !== undefined);
    const drawn = await countDrawnPixels(page);
    expect([drawn.opaque, drawn.partial, drawn.transparent].map((share) => Math.round(share * 1e6))).toEqual([
      1e6, 0, 0,
    ]);
    // Whoever watches is no puppeteer.
    expect(await evaluateInEngine(page, () => globalThis.bunraku.puppeteer.id)).toBe(null);
  });

  test("a fixed camera stays where the address has it", async () => {
    const page = await open("camera=1.5,1.25,4,0.25,1,0,30");
    await waitForFirstPose(page);
    await pauseAtStart(page);
    await waitInEngine(page, () => {
      const { camera } = globalThis.bunraku.stage.audience;
      const [x, y, z] = camera.matrixWorld.elements.slice(12);
      return Math.hypot(x - 1.5, y - 1.25, z - 4) < 1e-3 && Math.abs(camera.fov - 30) < 1e-3;
    });
  });

  test("an address that cannot be used says why", async () => {
    const page = await open("camera=1,2");
    await page.getByRole("alert").getByText("camera must be 6 or 7 numbers").waitFor();
  });
});

/** Return the alpha of the four corners of a PNG with alpha that has no interlacing. */
function cornerAlphas(png: Buffer): number[] {
  const [width, height, depth, type] = [png.readUInt32BE(16), png.readUInt32BE(20), png[24], png[25]];
  if (depth !== 8 || type !== 6) return [255];
  const parts: Buffer[] = [];
  for (let at = 8; at < png.length; at += 12 + png.readUInt32BE(at))
    if (png.toString("latin1", at + 4, at + 8) === "IDAT")
      parts.push(png.subarray(at + 8, at + 8 + png.readUInt32BE(at)));
  const data = inflateSync(Buffer.concat(parts));
  const stride = width * 4 + 1;
  const rows: Uint8Array[] = [];
  for (let y = 0; y < height; y++) {
    const row = Uint8Array.from(data.subarray(y * stride + 1, (y + 1) * stride));
    const above = rows[y - 1] ?? new Uint8Array(row.length);
    for (let x = 0; x < row.length; x++) {
      const [left, up, corner] = [row[x - 4] ?? 0, above[x], above[x - 4] ?? 0];
      const estimate = left + up - corner;
      const [a, b, c] = [left, up, corner].map((value) => Math.abs(estimate - value));
      const paeth = a <= b && a <= c ? left : b <= c ? up : corner;
      row[x] += [0, left, up, (left + up) >> 1, paeth][data[y * stride]];
    }
    rows.push(row);
  }
  return [rows[0][3], rows[0][width * 4 - 1], rows[height - 1][3], rows[height - 1][width * 4 - 1]];
}
