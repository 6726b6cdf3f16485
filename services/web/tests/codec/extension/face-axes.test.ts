import * as fc from "fast-check";
import { expect, test } from "vitest";
import { DamagedBlock } from "../../../src/codec/errors";
import { faceLayout, inverseFaceWeights, unpackFace } from "../../../src/codec/extension/face-axes";
import { faceExpressionNames } from "../../../src/motion/face";
import { goldenHandsFaceTrack, handsFaceVectors } from "../../golden-hands-face";

const golden = handsFaceVectors();

test("axes have the names of their expressions", () => {
  golden.tracks.slice(2).forEach((track) => {
    const { content } = goldenHandsFaceTrack(track);
    expect(content.part === "face" ? faceExpressionNames(content.face) : []).toEqual(track.names);
  });
});

test("channels have three axes, the last one the rest", () => {
  const layout = faceLayout({ axes: [0, 5, 9, 12] }, [1, 0, 0, -8]);
  expect([...layout.axes]).toEqual([3, 1]);
  expect([...layout.scaleOffsets]).toEqual([128, 0, 0, -1024, 0, 0]);
  expect([...inverseFaceWeights(1)]).toEqual([1, 0, 0, 0, 1, 0, 0, 0, 1]);
});

test("a damaged description is refused or in range", () => {
  fc.assert(
    fc.property(fc.uint8Array({ maxLength: 60 }), (data) => {
      try {
        const [face, offsets] = unpackFace(data);
        expect(offsets.length).toBe(face.axes.length);
        faceLayout(face, offsets);
      } catch (error) {
        expect(error).toBeInstanceOf(DamagedBlock);
      }
    }),
  );
});
