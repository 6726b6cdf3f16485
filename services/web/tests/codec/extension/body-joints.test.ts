import { expect, test } from "vitest";
import { DamagedBlock } from "../../../src/codec/errors";
import { bodyLayout, inverseBodyWeights, unpackBody } from "../../../src/codec/extension/body-joints";
import { extensionVectors } from "../../golden-extensions";
import { decodeBase64 } from "../../golden-vectors";

test.each(extensionVectors().tracks)("joints $names", ({ joints, names, channels }) => {
  const body = unpackBody(decodeBase64(String(joints)));
  expect(body.names).toEqual(names);
  expect(bodyLayout(body).count).toBe(channels);
  expect(inverseBodyWeights(body).every(Number.isFinite)).toBe(true);
});

test("a description without joints is refused", () => {
  expect(() => unpackBody(new Uint8Array(19))).toThrow(DamagedBlock);
});
