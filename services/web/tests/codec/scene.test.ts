import * as fc from "fast-check";
import { describe, expect, test } from "vitest";
import { SCENE_LAYOUT } from "../../src/codec/channel-layout";
import { decodeCoefficients } from "../../src/codec/coefficients";
import { DamagedBlock } from "../../src/codec/errors";
import { loadShippedPrior } from "../../src/codec/prior";
import { decodeSceneBlock, SCENE_VALUE_COUNT, SceneTrack } from "../../src/codec/scene";
import { decodeBase64, loadVectors } from "../golden-vectors";

interface SceneVectors {
  tracks: Record<string, unknown>[];
  valid: {
    track: number;
    block: string;
    frames: number;
    step: number;
    q: number[];
    values: { instant: number; numbers: number[] }[];
  }[];
  /** Blocks of the first track. */
  invalid: { why: string; block: string }[];
}

const golden = loadVectors<SceneVectors>("scene");
const tracks = golden.tracks.map((track) => SceneTrack.fromDescription(track));

describe("golden blocks", () => {
  test.each(golden.valid)("block of track $track, $frames frames at step $step", (vector) => {
    const track = tracks[vector.track];
    const { frames, step, heading, q } = decodeCoefficients(
      loadShippedPrior(),
      decodeBase64(vector.block),
      track.blockFrames,
      track.fps,
      SCENE_LAYOUT,
    );
    expect([frames, step, heading]).toEqual([vector.frames, vector.step, 0]);
    expect([...q]).toEqual(vector.q);
    const block = decodeSceneBlock(track, decodeBase64(vector.block));
    expect(block.frames).toBe(vector.frames);
    const out = new Float64Array(SCENE_VALUE_COUNT);
    for (const { instant, numbers } of vector.values) {
      block.valuesAt(instant, out);
      numbers.forEach((value, i) => expect(Math.abs(out[i] - value)).toBeLessThan(1e-9 * Math.max(1, Math.abs(value))));
    }
  });

  test.each(golden.invalid)("refuses: $why", ({ block }) => {
    expect(() => decodeSceneBlock(tracks[0], decodeBase64(block))).toThrow(DamagedBlock);
  });

  test("include cameras and lights, moving and still", () => {
    expect(tracks.map(({ kind, blockCount: blocks }) => [kind, blocks])).toEqual([
      ["camera", 3],
      ["light", 6],
      ["camera", 1],
    ]);
    expect(golden.valid.map(({ q }) => q.length)).toContain(0);
  });
});

test("damaged block decodes to finite values or is refused", () => {
  const blocks = golden.valid.map((vector) => ({ track: tracks[vector.track], valid: decodeBase64(vector.block) }));
  const change = fc.tuple(fc.nat(), fc.nat(255));
  const out = new Float64Array(SCENE_VALUE_COUNT);
  let decoded = 0,
    refused = 0;
  const expectFiniteOrRefused = (track: SceneTrack, data: Uint8Array): void => {
    try {
      const block = decodeSceneBlock(track, data);
      block.valuesAt(block.frames / 2, out);
      expect(out.every(Number.isFinite)).toBe(true);
      expect(out[6]).toBeGreaterThanOrEqual(0);
      decoded++;
    } catch (error) {
      if (!(error instanceof DamagedBlock)) throw error;
      refused++;
    }
  };
  fc.assert(
    fc.property(
      fc.constantFrom(...blocks),
      fc.array(change, { minLength: 1, maxLength: 8 }),
      fc.double({ min: 0, max: 1, noNaN: true }),
      fc.uint8Array({ maxLength: 400 }),
      ({ track, valid }, changes, part, random) => {
        const damaged = valid.slice();
        for (const [position, value] of changes) damaged[position % damaged.length] = value;
        expectFiniteOrRefused(track, damaged);
        expectFiniteOrRefused(track, valid.subarray(0, Math.floor(part * valid.length)));
        expectFiniteOrRefused(track, random);
      },
    ),
    { numRuns: 1000 },
  );
  console.log(`${decoded} damaged scene blocks decoded, ${refused} refused`);
});

describe("invalid description is refused with a reason", () => {
  test.each([
    [{ type: "motion" }, "camera or light"],
    [{ codec: "bunraku.motion/2" }, "bunraku.motion/2"],
    [{ fps: 0 }, "light track: fps"],
    [{ first_frames: 0 }, "first_frames"],
    [{ full: 0 }, "full"],
    [{ full: "800" }, "full"],
    [{ full: 1e7 }, "full"],
    [{ reference: [0, 0, 0, 0, 0, 0] }, "reference"],
    [{ reference: [0, 0, 0, 0, 0, 0, NaN] }, "reference"],
    [{ reference: [0, 0, 0, 0, 0, 0, "1"] }, "reference"],
    [{ reference: null }, "reference"],
    [{ rates: [] }, "light track: rates"],
    [{ rates: [{ kbps: 1, mean: 1 }] }, "rate 0"],
  ])("%o", (change, message) => {
    const parse = () => SceneTrack.fromDescription({ ...golden.tracks[1], ...change });
    expect(parse).toThrow(DamagedBlock);
    expect(parse).toThrow(message);
  });
});
