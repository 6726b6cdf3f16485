import * as fc from "fast-check";
import { describe, expect, test } from "vitest";
import { LANDMARK, visibilityOf } from "../../src/webcam/landmark";
import { decodeLandmarkList } from "../../src/webcam/landmark-list";

/** Encode landmarks of five numbers as MediaPipe does; zeros may be left out. */
function encode(landmarks: readonly (readonly number[])[], omitsZeros = false): Uint8Array {
  const bytes: number[] = [];
  for (const values of landmarks) {
    const message = values.flatMap((value, index) => {
      if (omitsZeros && value === 0) return [];
      return [((index + 1) << 3) | 5, ...new Uint8Array(Float32Array.of(value).buffer)];
    });
    bytes.push((1 << 3) | 2, message.length, ...message);
  }
  return Uint8Array.from(bytes);
}

const number = fc.float({ noNaN: true, noDefaultInfinity: true });
const landmark = fc.array(number, { minLength: 5, maxLength: 5 });
const landmarks = fc.array(landmark, { minLength: 33, maxLength: 33 });

describe("a list of landmarks", () => {
  test("has x, y, z and visibility of each", () => {
    fc.assert(
      fc.property(landmarks, fc.boolean(), (list, omitsZeros) => {
        const decoded = decodeLandmarkList(encode(list, omitsZeros));
        const expected = list.flatMap((values) => values.slice(0, 4)).map((value) => value + 0);
        expect([...decoded].map((value) => value + 0)).toEqual(expected);
      }),
    );
  });

  test("fields that are not known are skipped", () => {
    const list = encode(Array.from({ length: 33 }, (_, index) => [index, 0, 0, 0.5, 0]));
    const unknown = [(9 << 3) | 0, 0xac, 2, (8 << 3) | 2, 3, 1, 2, 3, (7 << 3) | 1, 0, 0, 0, 0, 0, 0, 0, 0];
    const decoded = decodeLandmarkList(Uint8Array.from([...unknown, ...list]));
    expect(decoded[LANDMARK.rightToes * 4]).toBe(32);
    expect(visibilityOf(decoded, LANDMARK.nose)).toBe(0.5);
  });

  test("of another length is rejected", () => {
    const one = [0, 0, 0, 0, 0];
    expect(() => decodeLandmarkList(encode([one]))).toThrow(RangeError);
    expect(() => decodeLandmarkList(encode(Array.from({ length: 34 }, () => one)))).toThrow(RangeError);
  });

  test("any other bytes are rejected", () => {
    fc.assert(
      fc.property(fc.uint8Array({ maxLength: 200 }), (bytes) => {
        expect(() => decodeLandmarkList(bytes)).toThrow(RangeError);
      }),
    );
  });
});
