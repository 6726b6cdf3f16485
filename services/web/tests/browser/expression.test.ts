/** Fingers and face of the puppet as they are drawn. */
import type { Page } from "playwright-core";
import { expect, test } from "vitest";
import { AXIS_COUNT, EXPRESSIONS } from "../../src/motion/face";
import { describeInBrowser } from "./browser-suite";
import { evaluateInEngine, waitInEngine } from "./engine-probe";
import { pauseAtStart, waitForFirstPose } from "./page-probe";

/** Expressions with a weight of 1, and the bend of all joints of the fingers in radians. */
const CONTENTS: readonly (readonly [expressions: readonly string[], bend: number])[] = [
  [["blink"], 1.2],
  [["eyeBlinkLeft"], 0.4],
  [["happy"], 0],
  [["aa"], -0.2],
  [["ou"], 0.6],
  [["browInnerUp"], 0.2],
  [["lookLeft"], 0.8],
];

interface Sums {
  readonly face: number;
  readonly hand: number;
}

/** Return sums over the pixels of close-ups of face and hand at rest, for all contents, and at rest again. */
async function drawCloseUps(page: Page): Promise<Sums[]> {
  const size = await page.locator("#stage").evaluate(({ clientWidth, clientHeight }) => [clientWidth, clientHeight]);
  const contents = CONTENTS.map(([names, bend]) => ({
    weights: EXPRESSIONS.map((name) => +names.includes(name)),
    bend,
  }));
  const texts = await evaluateInEngine(
    page,
    async ({ contents, axisCount, size: [width, height] }) => {
      const { stage } = globalThis.bunraku;
      const { puppet, renderer, scene } = stage;
      const [box, hand] = [stage.faceBoxes[0], stage.drawnHandles[0]];
      if (!puppet || !box || !hand) throw new Error("The performer is not drawn.");
      const viewer = globalThis.bunraku.viewer;
      const pose = viewer.poseAt(performance.now());
      if (!pose) throw new Error("The performer has no pose.");
      const axes = Array.from({ length: axisCount }, (_, axis) => axis);
      const apply = (content: (typeof contents)[number] | null) => {
        const side = (i: number) => (i < 45 ? -1 : 1);
        const values = Float64Array.from({ length: 90 }, (_, i) => (i % 3 === 2 ? side(i) * (content?.bend ?? 0) : 0));
        const hands = { counts: new Array(10).fill(3), bases: new Float64Array(30), lengths: new Float64Array(30) };
        const face = content && { face: { axes }, weights: Float64Array.from(content.weights) };
        puppet.apply({ ...pose, face, hands: content && { hands, values } }, 0);
        scene.updateMatrixWorld();
      };
      const drawPart = (x: number, y: number) => {
        const half = (box.right - box.left) / 2;
        const camera = stage.audience.camera.clone();
        camera.setViewOffset(width, height, x - half, y - half, 2 * half, 2 * half);
        renderer.render(scene, camera);
        const { drawingBufferWidth, drawingBufferHeight } = renderer.getContext();
        const pixels = new Uint8Array(4 * drawingBufferWidth * drawingBufferHeight);
        const context = renderer.getContext();
        const format = [context.RGBA, context.UNSIGNED_BYTE] as const;
        context.readPixels(0, 0, drawingBufferWidth, drawingBufferHeight, ...format, pixels);
        return pixels.reduce((sum, value, at) => sum + value * (at % 997), 0);
      };
      const draw = (content: (typeof contents)[number] | null) => {
        apply(content);
        const face = drawPart((box.left + box.right) / 2, (box.top + box.bottom) / 2);
        return { face, hand: drawPart(hand.x, hand.y) };
      };
      // Fingers and face load with the first pose that has them.
      apply(contents[0]);
      while (puppet.group.getObjectByName("face")?.matrixWorld.elements[0] !== 1) {
        await new Promise((resolve) => setTimeout(resolve, 10));
        apply(contents[0]);
      }
      return JSON.stringify([null, ...contents, null].map(draw));
    },
    { contents, axisCount: AXIS_COUNT, size },
  );
  return JSON.parse(texts);
}

describeInBrowser("the puppet's expression", { server: "open" }, ({ open }) => {
  test.each(["", "?quality=best"])("fingers and face are drawn, and return to rest (%s)", async (address) => {
    const page = await open(address, { colorScheme: "dark", reducedMotion: "reduce" });
    await waitForFirstPose(page);
    await pauseAtStart(page);
    const sums = await drawCloseUps(page);
    const rest = sums.pop();
    expect(rest).toEqual(sums[0]);
    for (const part of ["face", "hand"] as const)
      expect(new Set(sums.map((sum) => sum[part])).size).toBe(CONTENTS.length + 1);
  });

  test("the eyes blink while the motion plays, and are open when it stands still", async () => {
    const page = await open("", { colorScheme: "dark" });
    await waitForFirstPose(page);
    await waitInEngine(page, () => {
      const elements = globalThis.bunraku.stage.puppet?.group.getObjectByName("face")?.matrixWorld.elements;
      return elements !== undefined && elements[0] > 0.3 && elements[4] === elements[0];
    });
    await pauseAtStart(page);
    await waitInEngine(page, () => {
      const elements = globalThis.bunraku.stage.puppet?.group.getObjectByName("face")?.matrixWorld.elements;
      return elements?.every((value) => value === 0) ?? false;
    });
  });
});
