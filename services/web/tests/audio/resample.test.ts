import * as fc from "fast-check";
import { expect, test } from "vitest";
import { HALF_TAPS, resample } from "../../src/audio/resample";

const FRAMES = 400;

/** Return a sine with this many cycles per sample; sample `HALF_TAPS - 1` is position 0. */
function sine(cycles: number, size: number): Float32Array {
  return Float32Array.from({ length: size }, (_, at) => Math.sin(2 * Math.PI * cycles * (at - (HALF_TAPS - 1))));
}

test("integer positions return the samples unchanged", () => {
  const samples = sine(0.21, FRAMES + 2 * HALF_TAPS);
  const out = new Float32Array(FRAMES).fill(9);
  resample(samples, 3, 1, out, 10, FRAMES - 10);
  expect([...out.subarray(0, 10)]).toEqual(new Array(10).fill(9));
  expect(out.subarray(10, FRAMES - 10)).toEqual(samples.subarray(HALF_TAPS - 1 + 3, HALF_TAPS - 1 + 3 + FRAMES - 20));
});

test("fractional positions are accurate to -55 dB at 14 kHz, -70 dB below 10", () => {
  fc.assert(
    fc.property(
      fc.double({ min: 0, max: 14_000, noNaN: true }),
      fc.double({ min: 0, max: 0.999, noNaN: true }),
      fc.double({ min: 0.995, max: 1.005, noNaN: true }),
      (hertz, at, speed) => {
        const cycles = hertz / 48_000;
        const out = new Float32Array(FRAMES);
        resample(sine(cycles, Math.ceil(FRAMES * speed) + 2 * HALF_TAPS + 2), at, speed, out, 0, FRAMES);
        const error = Math.max(
          ...out.map((sample, frame) => Math.abs(sample - Math.sin(2 * Math.PI * cycles * (at + frame * speed)))),
        );
        expect(20 * Math.log10(error + 1e-9)).toBeLessThan(hertz < 10_000 ? -70 : -55);
      },
    ),
  );
});
