import { expect, test } from "vitest";
import { DamagedBlock } from "../../src/codec/errors";
import { ExtensionTrack } from "../../src/codec/extension/track";
import { ExtensionBlockStore, openExtension } from "../../src/playout/extension-values";
import { extensionVectors, goldenDescription } from "../golden-extensions";
import { decodeBase64 } from "../golden-vectors";

const golden = extensionVectors();
const description = goldenDescription(golden.tracks[0]);
const blocks = golden.valid.filter(({ track }) => track === 0);

test("an opened track says whose part it is", () => {
  const { part, performer } = openExtension(description);
  expect([part, performer]).toEqual(["body", description.performer]);
});

test("an unusable track is damaged", () => {
  expect(() => openExtension({ ...description, codec: "bunraku.extension/9" })).toThrow(DamagedBlock);
});

test("values are zero until a block is there, and at the end of a loop those between its last and first frame", () => {
  const store = new ExtensionBlockStore(ExtensionTrack.fromDescription(description));
  const { fps, frames, durationUs } = store.track;
  const valuesAt = (frame: number) => {
    const values = new Float64Array(store.track.layout.count * 3).fill(7);
    return { isThere: store.valuesAt((frame * 1e6) / fps, true, durationUs, values), values: [...values] };
  };
  expect(valuesAt(0)).toEqual({ isThere: false, values: valuesAt(0).values.map(() => 0) });
  store.put(0, 1, decodeBase64(blocks[1].block));
  const [first, last, between] = [0, frames - 1, frames - 0.5].map(valuesAt);
  expect(first.isThere && last.isThere && between.isThere).toBe(true);
  between.values.forEach((value, n) => {
    expect(value).toBeCloseTo((first.values[n] + last.values[n]) / 2, 3);
  });
});
